# SPDX-License-Identifier: BSD-3-Clause
"""Tells a virtual fleet's path lengths about traffic, as the nodes do on ROS."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.costing.traffic_conditions import HeardTraffic, SlowPlace
from hive_navigation.ros.traffic_report import TrafficReport, Waiting
from hive_navigation.traffic.deadlock import LockWatch
from hive_navigation.traffic.landmarks import Landmarks

if TYPE_CHECKING:
    from blackboard.costing.traffic_conditions import TrafficConditions
    from hive_lab.fleets.simulated_bodies import SimulatedBodies
    from hive_lab.fleets.virtual_fleet import VirtualFleet

PERIOD = 1.0  # between two looks at who waits [s]


class ToldTraffic:
    """Tells the path lengths of all robots and of the blackboard what the traffic planner knows.

    Args:
        fleet: Whose path lengths.
        bodies: The fleet's, with a traffic planner and its zones.

    Raises:
        ValueError: The bodies have no traffic planner.
    """

    def __init__(self, fleet: VirtualFleet, bodies: SimulatedBodies) -> None:
        if bodies.coordinator is None:
            raise ValueError("the bodies have no traffic planner; give SimulatedBodies the models")
        self._fleet, self._simulation = fleet, bodies.simulation
        self._coordinator = bodies.coordinator
        self._report = TrafficReport(Landmarks(), LockWatch())
        self._heard = HeardTraffic(self._coordinator.roadmap.zones)
        self._use(self.conditions)
        fleet.network.schedule(PERIOD, self._look)

    @property
    def conditions(self) -> TrafficConditions:
        """What path lengths reckon with now."""
        return self._heard.conditions

    def close(self, zone: str) -> None:
        """Close a zone: no robot enters it, and no path leads through it."""
        self._coordinator.close(zone)
        self._tell()

    def open(self, zone: str) -> None:
        """Open a zone that was closed."""
        self._coordinator.open(zone)
        self._tell()

    def _look(self) -> None:
        self._fleet.network.schedule(PERIOD, self._look)
        waits = [
            Waiting(w.robot, w.waits_for, *w.at, w.since) for w in self._coordinator.waiting()
        ]
        at = {name: (pose.x, pose.y) for name, pose in self._simulation.poses.items()}
        self._report.note(self._fleet.network.now, waits, at)
        self._tell()

    def _tell(self) -> None:
        slow = [SlowPlace(each.x, each.y, each.delay) for each in self._report.slowest()]
        closed = self._coordinator.roadmap.closed
        if self._heard.hear(self._fleet.network.now, closed, slow):
            self._use(self.conditions)

    def _use(self, conditions: TrafficConditions) -> None:
        for lengths in (self._fleet.board_lengths, *self._fleet.path_lengths.values()):
            lengths.use(self._fleet.grid, conditions)
