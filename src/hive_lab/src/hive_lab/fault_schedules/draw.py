# SPDX-License-Identifier: BSD-3-Clause
"""Draws schedules: a few tasks, a hive, and trouble of one mood.

Faults that come singly and at any time seldom meet in the short moments that a protocol is made
for. So half of the schedules have a mood that brings such moments about; see `moods`.
"""

from __future__ import annotations

from dataclasses import replace
from random import Random
from typing import TYPE_CHECKING

from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose
from hive_lab.fault_schedules.faults import any_fault
from hive_lab.fault_schedules.scenarios import SCENARIOS, Setting
from hive_lab.fault_schedules.schedule import FAULT_PERIOD, SETTLE, Cancel, FaultSchedule, Post

if TYPE_CHECKING:
    from collections.abc import Sequence

_CANCELLED = 0.1
"""Share of the tasks that an operator cancels."""

_IN_A_MOOD = 0.5
"""Share of the schedules that have a mood."""

_FORGETFUL = 0.5
"""Share of the schedules whose hive soon forgets what has ended."""

_ANEW = 0.3
"""Share of the tasks in these that are posted anew under the same id."""


def draw(seed: int, scenario: str = "") -> FaultSchedule:
    """Draw a schedule.

    Args:
        seed: The same seed gives the same schedule.
        mood: A name of `SCENARIOS`; drawn too where it is left out.
    """
    random = Random(seed)
    in_a_mood = scenario or random.random() < _IN_A_MOOD
    schedule = _in_a_mood(seed, random, scenario) if in_a_mood else _ordinary(seed, random)
    return _forgetful(schedule) if random.random() < _FORGETFUL else schedule


def _in_a_mood(seed: int, random: Random, scenario: str) -> FaultSchedule:
    name = scenario or random.choice(list(SCENARIOS))
    setting: Setting = SCENARIOS[name](random)
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
        for fault in any_fault(random, members, SETTLE + random.uniform(0.0, FAULT_PERIOD))
    ]
    happenings = (*posts, *_cancels(random, posts), *faults)
    return FaultSchedule(seed, robots, happenings, scenario="anything at any time")


def _forgetful(schedule: FaultSchedule) -> FaultSchedule:
    """Have what has ended forgotten soon, and some of it posted anew."""
    random = Random(schedule.seed)
    keep, most = random.choice([0.5, 3.0, 12.0]), random.choice([1, 500])
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
        patience=replace(schedule.patience, keep_ended=keep, most_ended=most),
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
