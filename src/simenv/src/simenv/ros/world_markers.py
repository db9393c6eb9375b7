# SPDX-License-Identifier: BSD-3-Clause
"""Shows the world in RViz in 3D: shapes, doors, places, people."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from hive_common.ros.conversions import quaternion_of
from simenv.pacing import Every
from simenv.ros.conversions import stamp_of
from simenv.simulation import STEP
from simenv.world.shapes import prism

if TYPE_CHECKING:
    from simenv.simulation import Simulation
    from simenv.world.shapes import Shape
    from simenv.world.world_content import Place

COLOURS = {
    "walls": (0.75, 0.75, 0.72, 1.0),
    "benches": (0.72, 0.55, 0.35, 1.0),
    "racks": (0.35, 0.45, 0.60, 1.0),
    "doors": (0.55, 0.25, 0.20, 0.9),
    "stations": (0.95, 0.60, 0.10, 0.9),
    "chargers": (0.15, 0.65, 0.30, 0.9),
    "parking": (0.30, 0.50, 0.85, 0.9),
    "people": (0.85, 0.20, 0.45, 1.0),
}
"""Red, green, blue, opacity, 0..1."""

PERSON_HEIGHT = 1.7
PLACE_SIZE = 0.3
PEOPLE_RATE = 10.0  # [Hz, simulated time]


class WorldMarkers:
    """Shows a simulation's world.

    ROS Publishers:
        simenv/world_markers (visualization_msgs/MarkerArray): latched; frame map.
        simenv/people_markers (visualization_msgs/MarkerArray): 10 Hz where there are people.
    """

    def __init__(self, simulation: Simulation) -> None:
        """Show the world of a simulation."""
        self._simulation = simulation
        self._people_due = Every(PEOPLE_RATE, STEP)

    def start(self) -> None:
        """Open the topics."""
        self._world = rospy.Publisher(
            "simenv/world_markers", MarkerArray, queue_size=1, latch=True
        )
        self._people = rospy.Publisher("simenv/people_markers", MarkerArray, queue_size=1)
        self.show()

    def show(self) -> None:
        """Publish the present state of the world."""
        world = self._simulation.world
        shut = self._simulation.obstacles.shut
        markers = [_body(shape) for shape in world.shapes]
        markers += [_body(door, shown=door.name in shut) for door in world.doors]
        for kind in ("stations", "chargers", "parking"):
            for place in getattr(world, kind):
                markers += _sign(kind, place)
        self._world.publish(_numbered(markers))

    def tick(self, nanoseconds: int) -> None:
        """Publish where people are at a time [ns], if that is due."""
        world = self._simulation.world
        if not (world.people and self._people_due.has_come(nanoseconds)):
            return
        markers = []
        radii = {person.name: person.radius for person in world.people}
        for name, (x, y) in self._simulation.obstacles.people.items():
            marker = _marker("people", Marker.CYLINDER)
            marker.header.stamp = stamp_of(nanoseconds)
            marker.pose.position = Point(x, y, PERSON_HEIGHT / 2)
            marker.scale = Vector3(2 * radii[name], 2 * radii[name], PERSON_HEIGHT)
            markers.append(marker)
        self._people.publish(_numbered(markers))


def _marker(kind: str, form: int) -> Marker:
    marker = Marker(ns=kind, type=form, action=Marker.ADD, color=ColorRGBA(*COLOURS[kind]))
    marker.header.frame_id = "map"
    marker.pose.orientation = quaternion_of(0.0)
    return marker


def _numbered(markers: list[Marker]) -> MarkerArray:
    for number, marker in enumerate(markers):
        marker.id = number
    return MarkerArray(markers)


def _body(shape: Shape, *, shown: bool = True) -> Marker:
    """Return the marker of a shape; `shown` is false for an open door, which it removes."""
    marker = _marker(shape.kind, Marker.TRIANGLE_LIST)
    marker.scale = Vector3(1.0, 1.0, 1.0)
    if shown:
        triangles = prism(shape.area, shape.height)
        marker.points = [Point(*corner) for corner in triangles.reshape(-1, 3).tolist()]
    else:
        marker.action = Marker.DELETE
    return marker


def _sign(kind: str, place: Place) -> list[Marker]:
    """Return an arrow for a robot's pose at a place, and the name of the place."""
    arrow, name = _marker(kind, Marker.ARROW), _marker(kind, Marker.TEXT_VIEW_FACING)
    arrow.pose.position = Point(place.pose.x, place.pose.y, 0.02)
    arrow.pose.orientation = quaternion_of(place.pose.yaw)
    arrow.scale = Vector3(PLACE_SIZE, PLACE_SIZE / 3, PLACE_SIZE / 3)
    name.pose.position = Point(place.pose.x, place.pose.y, PLACE_SIZE)
    name.scale.z = PLACE_SIZE
    name.text = place.name
    return [arrow, name]
