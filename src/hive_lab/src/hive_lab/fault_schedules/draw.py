# SPDX-License-Identifier: BSD-3-Clause
"""Draws schedules: a hive, a few tasks, and faults.

Independent faults seldom meet in the short moments that a protocol is made for. Half of the
schedules therefore follow a scenario that produces such moments; see `scenarios`.
"""

from __future__ import annotations

from dataclasses import replace
from random import Random
from typing import TYPE_CHECKING

from attrs import evolve

from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose
from hive_lab.fault_schedules.drawn_features import (
    with_features,
    with_one_charger,
    with_strong_robot,
)
from hive_lab.fault_schedules.drawn_links import over_zenoh
from hive_lab.fault_schedules.faulty_network import Quality
from hive_lab.fault_schedules.scenarios import (
    ASIDE,
    ONE_CHARGER,
    SCENARIOS,
    STRONG_ROBOT,
    Setting,
)
from hive_lab.fault_schedules.schedule import (
    FAULT_PERIOD,
    SETTLE,
    BadLinks,
    Cancel,
    Crash,
    Cut,
    FaultSchedule,
    Freeze,
    Post,
    PowerCut,
    SetState,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hive_lab.fault_schedules.schedule import Happening

_CANCELLED = 0.1  # share of the tasks that an operator cancels
_WITH_SCENARIO = 0.5  # share of the schedules that follow a scenario
_FORGETFUL = 0.5  # share of the schedules whose hive soon forgets ended tasks
_ANEW = 0.3  # share of the tasks in these that are posted anew under the same id

_FLEETS = {STRONG_ROBOT: with_strong_robot, ONE_CHARGER: with_one_charger}
"""Which scenarios need a fleet of their own."""


def draw(seed: int, scenario: str = "", *, zenoh: bool = False) -> FaultSchedule:
    """Draw the schedule of a seed, in a scenario that by default is drawn too.

    Over Zenoh the same happens, and what happens to its connections besides.
    """
    random = Random(seed)
    follows = scenario or random.random() < _WITH_SCENARIO
    schedule = _by_scenario(seed, random, scenario) if follows else _ordinary(seed, random)
    schedule = _forgetful(schedule) if random.random() < _FORGETFUL else schedule
    schedule = with_features(schedule)
    schedule = _FLEETS[scenario](schedule) if scenario in _FLEETS else schedule
    return over_zenoh(schedule) if zenoh else schedule


def _by_scenario(seed: int, random: Random, scenario: str) -> FaultSchedule:
    name = scenario or random.choice(list(SCENARIOS))
    setting: Setting = {**SCENARIOS, **ASIDE}[name](random)
    posts = _posts(random)
    return FaultSchedule(
        seed,
        setting.robots,
        (*posts, *_cancels(random, posts), *setting.faults),
        setting.settings,
        late=setting.late,
        far_clocks=setting.far_clocks,
        proofs=setting.proofs,
        scenario=name,
    )


def _ordinary(seed: int, random: Random) -> FaultSchedule:
    """Draw a few faults of any kind at any time."""
    robots = random.randint(2, 4)
    members = FaultSchedule(seed, robots, ()).members
    posts = _posts(random)
    faults = [
        fault
        for _ in range(random.randint(1, 6))
        for fault in _any_fault(random, members, SETTLE + random.uniform(0.0, FAULT_PERIOD))
    ]
    happenings = (*posts, *_cancels(random, posts), *faults)
    return FaultSchedule(seed, robots, happenings, scenario="anything at any time")


def _forgetful(schedule: FaultSchedule) -> FaultSchedule:
    """Make the hive forget ended tasks soon, and post some of them anew."""
    random = Random(schedule.seed)
    keep, most = random.choice([0.1, 0.5, 3.0, 12.0]), random.choice([1, 500])
    anew = tuple(
        Post(each.at + random.uniform(5.0, 25.0), each.task, anew=True)
        for each in schedule.happenings
        if isinstance(each, Post) and random.random() < _ANEW
    )
    return replace(
        schedule,
        happenings=(
            *schedule.happenings,
            *(each for each in anew if each.at < SETTLE + FAULT_PERIOD),
        ),
        board=evolve(schedule.board, keep_ended=keep, most_ended=most),
    )


def _posts(random: Random) -> Sequence[Post]:
    return [_post(random, number) for number in range(random.randint(4, 8))]


def _post(random: Random, number: int) -> Post:
    kind = random.choice(list(TaskType))
    goals = tuple(
        Pose(random.uniform(0.0, 9.0), random.uniform(0.0, 9.0))
        for _ in range(random.randint(kind.goals_needed, 3))
    )
    priority, payload = random.choice([0, 0, 5, 9]), random.uniform(0.0, 5.0)
    task = Task(f"T{number + 1}", kind, goals, priority, payload)
    return Post(SETTLE + random.uniform(0.0, 0.7 * FAULT_PERIOD), task)


def _cancels(random: Random, posts: Sequence[Post]) -> Sequence[Cancel]:
    return [
        Cancel(post.at + random.uniform(0.0, 15.0), post.task.id)
        for post in posts
        if random.random() < _CANCELLED
    ]


def _any_fault(random: Random, members: tuple[str, ...], at: float) -> list[Happening]:
    """Draw a fault of any kind that hits some of these members at a time [s]."""
    kind = random.choices(list(_KINDS), list(_KINDS.values()))[0]
    return kind(random, members, at)


def _crash(random: Random, members: tuple[str, ...], at: float) -> list[Happening]:
    how = random.choices(["plain", "disk lost", "for ever"], [8, 1, 1])[0]
    back_after = random.choice([0.3, 1.0, 3.0, 12.0]) * random.random()
    return [
        Crash(
            at,
            random.choice(members),
            None if how == "for ever" else back_after,
            disk_lost=how == "disk lost",
            while_writing=random.choice([True, False]),
        )
    ]


def _freeze(random: Random, members: tuple[str, ...], at: float) -> list[Happening]:
    return [Freeze(at, random.choice(members), random.choice([0.8, 3.0, 6.0, 14.0]))]


def _cut(random: Random, members: tuple[str, ...], at: float) -> list[Happening]:
    group = tuple(random.sample(members, random.randint(1, len(members) - 1)))
    others: tuple[str, ...] = ()
    if random.random() < 0.3:  # noqa: PLR2004  (a share: some cuts are between two groups only)
        rest = [name for name in members if name not in group]
        others = tuple(random.sample(rest, random.randint(1, len(rest))))
    way = random.choice([True, False])
    holds = random.choice([True, False])
    return [Cut(at, group, random.uniform(0.5, 14.0), way, others, holds)]


def _bad_links(random: Random, _: tuple[str, ...], at: float) -> list[Happening]:
    quality = Quality(
        random.choice([0.0, 0.1, 0.3, 0.5]),
        random.choice([0.0, 0.2]),
        random.choice([0.02, 0.5, 2.0]),
    )
    return [BadLinks(at, random.uniform(2.0, 20.0), quality)]


def _power_cut(random: Random, _: tuple[str, ...], at: float) -> list[Happening]:
    return [PowerCut(at, random.uniform(0.1, 5.0))]


def _defect(random: Random, members: tuple[str, ...], at: float) -> list[Happening]:
    robot = random.choice(members[1:])
    back = at + random.uniform(1.0, 15.0)
    return [SetState(at, robot, "defect"), SetState(back, robot, "idle")]


_KINDS: dict[Callable[[Random, tuple[str, ...], float], list[Happening]], int] = {
    _crash: 7,
    _freeze: 4,
    _cut: 4,
    _bad_links: 3,
    _power_cut: 1,
    _defect: 1,
}
"""Relative frequency of each kind of fault."""
