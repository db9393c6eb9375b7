# SPDX-License-Identifier: BSD-3-Clause
"""What `hive compare` and the window that shows its results agree on."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

HIVE = "hive"
"""The architecture that the product is."""

ARCHITECTURES: Mapping[str, str] = MappingProxyType(
    {
        HIVE: "hive",
        "report": "report's blackboard",
        "central": "central dispatcher",
        "contract_net": "contract net",
    }
)
"""The architectures that can be compared, by name, in words."""

RUN_ON = ("virtual", "simulator")
"""Where an experiment runs: on virtual time in one process, or as a whole system on ROS."""

BLACKBOARD = "blackboard"
"""In faults, the process that coordinates, whatever the architecture calls it."""

MOST_LOSS = 0.5  # largest share of lost messages

# The files in the folder of the results, for whoever shows them.
PAGE = "page.html"  # tables and pictures, for a browser
TABLE = "table.csv"  # the figures of each run
# `description`; `table`, rows of texts with a heading; and `pictures`, files by title
SHOWN = "shown.json"
