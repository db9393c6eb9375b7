# SPDX-License-Identifier: BSD-3-Clause
"""How often a vehicle tells how it is."""

from typing import Annotated

import attrs

from hive_common.structuring import positive


@attrs.frozen(kw_only=True)
class Rates:
    """The periods of a vehicle's messages; changes are told at once besides."""

    state_period: Annotated[float, positive("time between states [s]", 30)] = 1.0
    visualization_period: Annotated[float, positive("time between visualizations [s]", 30)] = 0.5
