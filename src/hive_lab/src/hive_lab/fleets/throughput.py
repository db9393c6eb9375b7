# SPDX-License-Identifier: BSD-3-Clause
"""How much of its throughput a fleet keeps as it grows, and with something in its way."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from hive_lab.fleets.coordination import by_a_plan
from hive_lab.fleets.crowd import Crowd, by_right_of_way
from hive_lab.fleets.sites import LANE, with_people
from hive_navigation.planning.ompl_planner import OmplPlanner
from hive_navigation.planning.path import Path
from hive_navigation.traffic.deadlock import LockWatch
from hive_navigation.traffic.lock_resolver import ResolvingCoordinator
from robot_description.models import load_model

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
        person_contacts: Between a robot and a person.
        longest_stand: For which a robot with a goal stood still [s].
        cpu: Processor time for a simulated second [s].
        locks: How many the traffic planner has found.
        plan_median, plan_p95: Processor time of a plan, median and 95th percentile [s]; 0 without
            a traffic planner.
    """

    robots: int
    duration: float
    drives: tuple[Drive, ...]
    models: Mapping[str, str]
    contacts: int
    wall_contacts: int
    person_contacts: int
    longest_stand: float
    cpu: float
    locks: int
    plan_median: float
    plan_p95: float

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


@dataclass(frozen=True)
class Trouble:
    """What is in a fleet's way.

    Attributes:
        people: How many people walk about.
        closes: Whether the site's lane is closed for the middle third of the time.
        delays: Whether robots stop at random; see `Delays`.
    """

    people: int = 0
    closes: bool = False
    delays: bool = False


def measure(
    site: Site,
    robots: int,
    seconds: float,
    models: Sequence[str],
    seed: int = 1,
    *,
    planned: bool = False,
    trouble: Trouble | None = None,
) -> Throughput:
    """Let a crowd drive for a simulated time [s].

    Args:
        site: Where.
        robots: How many.
        seconds: How long.
        models: The robots' models, in turn.
        seed: Of everything random.
        planned: Whether a traffic planner coordinates it.
        trouble: What is in its way; nothing by default. A lane closes for robots with a traffic
            planner only, and no goal is in it then.
    """
    trouble = trouble or Trouble()
    site = with_people(site, trouble.people, seed)
    zones = site.zones if trouble.closes else ()
    traffic_of = partial(by_a_plan, models, zones) if planned else by_right_of_way
    avoided = site.lane if trouble.closes else None
    crowd = Crowd(robots, seed, site, models, traffic_of, avoided, delayed=trouble.delays)
    coordinator = crowd.traffic.coordinator
    began = time.process_time()
    if trouble.closes and coordinator is not None:
        crowd.run(seconds / 3)
        coordinator.close(LANE)
        crowd.run(seconds / 3)
        coordinator.open(LANE)
        crowd.run(seconds / 3)
    else:
        crowd.run(seconds)
    spent = time.process_time() - began
    others = Counter(_kind(contact.other, crowd) for contact in crowd.simulation.contacts)
    watch = coordinator.watch if isinstance(coordinator, ResolvingCoordinator) else LockWatch()
    return Throughput(
        robots,
        seconds,
        tuple(crowd.drives),
        {name: crowd.simulation.model(name).name for name in crowd.simulation.names},
        others["robot"],
        others["wall"],
        others["person"],
        max(crowd.longest_stand.values()),
        spent / seconds,
        watch.counts.total(),
        *map(float, np.quantile(crowd.traffic.plan_times or [0.0], (0.5, 0.95))),
    )


def _kind(name: str, crowd: Crowd) -> str:
    """Return what a robot has touched."""
    if name in crowd.simulation.names:
        return "robot"
    people = (person.name for person in crowd.simulation.world.people)
    return "person" if name in people else "wall"


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
