# SPDX-License-Identifier: BSD-3-Clause
"""What RViz shows of planned traffic: lanes, zones, reserved routes, and who waits for whom."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from hive_navigation.mapf.roadmap import need
from hive_navigation.mapf.route import marks

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from hive_common.zone import Zone
    from hive_navigation.mapf.roadmap import Roadmap
    from hive_navigation.mapf.route import Route
    from hive_navigation.ros.traffic_report import Waiting
    from hive_navigation.traffic.right_of_way import Announcement

LANE = ColorRGBA(0.55, 0.60, 0.70, 0.6)
RESERVED = ColorRGBA(0.00, 0.45, 0.70, 0.25)
ZONE = ColorRGBA(0.00, 0.62, 0.45, 0.8)
SHUT = ColorRGBA(0.84, 0.15, 0.16, 0.9)
WAITS = ColorRGBA(0.84, 0.15, 0.16, 0.9)
LANE_WIDTH, ZONE_WIDTH = 0.02, 0.05  # [m]
ARROW = Vector3(0.06, 0.18, 0.20)  # diameter of shaft and head, length of the head [m]
LANE_HEIGHT, ROUTE_HEIGHT, WAIT_HEIGHT = 0.005, 0.01, 0.5  # above the floor [m]


def lanes_marker(roadmap: Roadmap, radius: float, header: Header) -> Marker:
    """Return the lanes on which a robot of a radius [m] fits as one marker.

    A lane that leads both ways is drawn once.
    """
    fits = roadmap.lanes[roadmap.widths >= need(radius)]
    pairs = np.unique(np.sort(fits, axis=1), axis=0)
    marker = _marker("lanes", 0, Marker.LINE_LIST, LANE, header)
    marker.scale.x = LANE_WIDTH
    marker.points = [Point(x, y, LANE_HEIGHT) for x, y in roadmap.places[pairs.ravel()].tolist()]
    return marker


def traffic_markers(
    routes: Mapping[str, Route],
    robots: Mapping[str, Announcement],
    waits: Iterable[Waiting],
    zones: Iterable[Zone],
    header: Header,
) -> MarkerArray:
    """Return what each robot has still reserved, an arrow from each waiting robot, and zones.

    All earlier markers of the array are deleted first.

    Args:
        routes: The newest route of each robot, by name.
        robots: What each robot has announced last, by name.
        waits: Who waits for whom.
        zones: What an operator has set; those that are closed say so, and are red.
        header: Of the markers.
    """
    markers = [Marker(header=header, action=Marker.DELETEALL)]
    for number, (name, route) in enumerate(sorted(routes.items())):
        robot = robots.get(name)
        if robot is None or robot.plan.epoch != route.plan.epoch:
            continue
        passed = zip(marks(route.first, route.places), route.places, strict=True)
        ahead = tuple(place for mark, place in passed if mark > robot.passed)
        if ahead:
            markers.append(_reserved(number, robot, ahead, header))
    for number, wait in enumerate(waits):
        other = robots.get(wait.waits_for)
        if other is not None:
            arrow = _marker("waits", number, Marker.ARROW, WAITS, header)
            arrow.scale = ARROW
            arrow.points = [
                Point(wait.x, wait.y, WAIT_HEIGHT),
                Point(other.x, other.y, WAIT_HEIGHT),
            ]
            markers.append(arrow)
    for number, zone in enumerate(zones):
        outline = _marker(
            "zones", number, Marker.LINE_STRIP, SHUT if zone.closed else ZONE, header
        )
        outline.scale.x = ZONE_WIDTH
        corners = (*zone.corners, zone.corners[0])
        outline.points = [Point(x, y, LANE_HEIGHT) for x, y in corners]
        markers.append(outline)
    return MarkerArray(markers)


def _reserved(
    number: int, robot: Announcement, ahead: tuple[tuple[float, float], ...], header: Header
) -> Marker:
    marker = _marker("reservations", number, Marker.LINE_STRIP, RESERVED, header)
    marker.scale.x = 2 * robot.radius
    marker.points = [Point(x, y, ROUTE_HEIGHT) for x, y in ((robot.x, robot.y), *ahead)]
    return marker


def _marker(space: str, number: int, kind: int, color: ColorRGBA, header: Header) -> Marker:
    return Marker(
        header=header,
        ns=space,
        id=number,
        type=kind,
        action=Marker.ADD,
        pose=Pose(Point(), Quaternion(0.0, 0.0, 0.0, 1.0)),
        color=color,
    )
