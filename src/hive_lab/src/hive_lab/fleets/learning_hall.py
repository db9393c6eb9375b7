# SPDX-License-Identifier: BSD-3-Clause
"""A hall in which robots can learn how long tasks take them, and how much energy.

They measure their batteries, and are told about traffic. Half-way through, the world can change.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from attrs import evolve

from fleet_manager.config.fleet_file import read_fleet
from fleet_manager.config.load import Load
from hive_common.pose import Pose
from hive_lab.fleets.hall_files import write_hall
from hive_lab.fleets.simulated_bodies import SimulatedBodies
from hive_lab.fleets.sites import BETWEEN_RACKS, LANE, hall
from hive_lab.fleets.told_traffic import ToldTraffic
from hive_lab.fleets.virtual_fleet import VirtualFleet

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.domain.record import TaskUpdate

LOAD = Load(at_once=20, per_hour=400.0, minutes=1440.0)
WARM_UP = 2.5  # time in which every robot tells its status before the first task comes [s]
LOOK = 1.0  # time between two looks at how many tasks have ended [s]
WORN = "robot1"  # whose wheels wear
WEAR = 1.5  # their friction then, as a multiple of that before


class LearningHall:
    """A hall with robots of all models, which decide by their bids.

    Args:
        robots: How many.
        seed: Of the simulation's noise and of the tasks.

    Attributes:
        fleet, bodies, traffic: The robots, what moves them, and what they are told of traffic.
    """

    def __init__(self, robots: int, seed: int) -> None:
        with TemporaryDirectory() as folder:
            files = write_hall(Path(folder), robots)
            fleet = evolve(read_fleet(files.fleet), decision="distributed")
            models = [robot.model for robot in fleet.robots]
            self.bodies = SimulatedBodies(files.world, seed, files.map, models, hall().zones)
            self.fleet = VirtualFleet(fleet, files.map, self.bodies, {}, measured=True)
        self.traffic = ToldTraffic(self.fleet, self.bodies)
        self._seed = seed

    def change(self) -> None:
        """Wear the wheels of one robot, and close the lane."""
        self.fleet.true_batteries[WORN].friction = WEAR
        self.traffic.close(LANE)

    def run(
        self,
        tasks: int,
        on_update: Callable[[TaskUpdate], None],
        *,
        limit: float,
        changes: bool = False,
    ) -> bool:
        """Do random tasks; return whether all have ended within a limit [s].

        Args:
            tasks: How many.
            on_update: Called with every update of a task.
            limit: How long they may take [s].
            changes: Whether the world changes when half of them have ended; see `change`.
        """
        ended: set[str] = set()

        def note(update: TaskUpdate) -> None:
            if update.state.is_terminal:
                ended.add(update.task_id)
            on_update(update)

        self.fleet.watch(note)
        self.fleet.run(WARM_UP)
        for each in LOAD.draw(self.fleet.grid, self._seed, _in_the_lane())[:tasks]:
            self.fleet.network.schedule(each.after, partial(self.fleet.post, each.task))
        end = self.fleet.network.now + limit
        while len(ended) < tasks and self.fleet.network.now < end:
            self.fleet.run(LOOK)
            if changes and len(ended) >= tasks / 2:
                self.change()
                changes = False
        return len(ended) == tasks


def _in_the_lane() -> list[Pose]:
    """Return poses all over the lane: while it is closed, no goal there can be reached."""
    left, low, right, high = map(int, BETWEEN_RACKS)
    return [Pose(x, y) for x in range(left, right + 1) for y in range(low, high + 1)]
