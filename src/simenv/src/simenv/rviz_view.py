# SPDX-License-Identifier: BSD-3-Clause
"""Fits RViz's view from above to a map, so that it opens showing the whole of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import yaml

from hive_common.errors import MapError

if TYPE_CHECKING:
    from hive_common.pose import Pose

AROUND = (60, 140)
"""What menu, tools, status and docks take of the window's width and height [pixels]."""


def fitted(config: str, origin: Pose, size: tuple[float, float]) -> str:
    """Return an RViz configuration that shows the whole of a map.

    Args:
        config: A configuration with a TopDownOrtho view, as RViz writes it.
        origin: Lower left corner of the map, frame map [m, m, rad].
        size: Width and height of the map [m].

    Raises:
        MapError: The configuration has no such view, or the map no size.
    """
    if min(size) <= 0:
        raise MapError(f"the map is {size[0]:g} m x {size[1]:g} m; it must have a size")
    content = yaml.safe_load(config)
    try:
        window = content["Window Geometry"]["Width"], content["Window Geometry"]["Height"]
        view = content["Visualization Manager"]["Views"]["Current"]
    except (KeyError, TypeError):
        raise MapError("the RViz configuration has no window or view; take hive.rviz") from None
    view["Scale"] = min((window[axis] - AROUND[axis]) / size[axis] for axis in (0, 1))
    view["X"] = origin.x + size[0] / 2
    view["Y"] = origin.y + size[1] / 2
    return str(yaml.safe_dump(content, sort_keys=False))
