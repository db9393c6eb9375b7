# SPDX-License-Identifier: BSD-3-Clause
"""How much of its throughput a fleet keeps when it grows."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from hive_lab.fleets.coordination import by_a_plan
from hive_lab.fleets.crowd import Crowd, by_right_of_way
from robot_description.models import load_model
from robot_navigation.planning.ompl_planner import OmplPlanner
from robot_navigation.planning.path import Path

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hive_lab.fleets.crowd import Drive
    from hive_lab.fleets.sites import Site

HOUR = 3600.0  # [s]


@dataclass(frozen=True)
class Throughput:
    """What a fleet did in a time.

    Attributes:
        robots: How many there were.
        duration: How long they drove, simulated [s].
        drives: All goals that ended.
        models: The model of each robot.
        contacts: Between two robots.
        wall_contacts: Between a robot and what does not move.
        longest_stand: For which a robot with a goal stood still [s].
        cpu: Processor time for a simulated second [s].
    """

    robots: int
    duration: float
    drives: tuple[Drive, ...]
    models: Mapping[str, str]
    contacts: int
    wall_contacts: int
    longest_stand: float
    cpu: float

    @property
    def reached(self) -> tuple[Drive, ...]:
        """The drives that ended at their goal."""
        return tuple(drive for drive in self.drives if not drive.outcome)

    @property
    def given_up(self) -> int:
        """How many goals were given up."""
        return len(self.drives) - len(self.reached)

    @property
    def rate(self) -> float:
        """Goals per hour and robot."""
        return len(self.reached) * HOUR / (self.duration * self.robots)


def measure(
    site: Site,
    robots: int,
    seconds: float,
    models: Sequence[str],
    seed: int = 1,
    *,
    planned: bool = False,
) -> Throughput:
    """Let a crowd drive for a simulated time [s].

    Args:
        site: Where.
        robots: How many.
        seconds: How long.
        models: The robots' models, in turn.
        seed: Of everything random.
        planned: Whether a traffic planner coordinates it.
    """
    traffic_of = partial(by_a_plan, models) if planned else by_right_of_way
    crowd = Crowd(robots, seed, site, models, traffic_of)
    began = time.process_time()
    crowd.run(seconds)
    spent = time.process_time() - began
    contacts = crowd.simulation.contacts
    names = set(crowd.simulation.names)
    between = sum(contact.other in names for contact in contacts)
    return Throughput(
        robots,
        seconds,
        tuple(crowd.drives),
        {name: crowd.simulation.model(name).name for name in crowd.simulation.names},
        between,
        len(contacts) - between,
        max(crowd.longest_stand.values()),
        spent / seconds,
    )


class TimeAlone:
    """How long a robot takes to a goal when it is alone.

    Drives of different length make few drives a poor measure of throughput. The time alone is a
    line over the length of the shortest path, fitted to what one robot alone has driven, so it
    takes the luck with the goals out of the share that a fleet keeps.
    """

    def __init__(self, site: Site, model: str, alone: Sequence[Drive]) -> None:
        """Fit the line to drives of one robot of a model."""
        self._planner = OmplPlanner(site.grid, load_model(model).base.circumscribed_radius)
        lengths = np.array([self._length(drive) for drive in alone])
        times = np.array([drive.ended - drive.began for drive in alone])
        self._slope, self._least = map(float, np.polyfit(lengths, times, 1))

    def of(self, drive: Drive) -> float:
        """Return the time in which one robot alone would do a drive [s]."""
        return self._least + self._slope * self._length(drive)

    def _length(self, drive: Drive) -> float:
        return Path(self._planner.plan(drive.origin, drive.goal[:2])).length


def share_kept(fleet: Throughput, alone: Mapping[str, TimeAlone]) -> float:
    """Return the share of its throughput that each robot keeps in a fleet, about 0..1.

    It is the time that the drives that got to their goals would take alone, by `alone` for each
    model, over the time that all took. Drives that have not ended are left out of both.
    """
    driving = sum(drive.ended - drive.began for drive in fleet.drives)
    return sum(alone[fleet.models[drive.robot]].of(drive) for drive in fleet.reached) / driving
