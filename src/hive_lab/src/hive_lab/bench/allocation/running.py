# SPDX-License-Identifier: BSD-3-Clause
"""A running hive on virtual time: when the tasks of an instance are done.

Blackboard, robots and controllers are those that run on real robots; the network takes 1 ms for a
message, and a drive takes as long as its path is long at 1 m/s.
"""

from __future__ import annotations

import itertools
import math
import time
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from blackboard.costing.experience import MEAN_SPEED_SHARE
from blackboard.domain.settings import RaftSettings
from blackboard.domain.talker import BACKUP, TASK_STATE
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT, Hive

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from blackboard.domain.record import TaskUpdate
    from blackboard.domain.settings import BlackboardSettings
    from blackboard.domain.task import TaskStep
    from hive_lab.bench.allocation.instances import Places

    Floats = NDArray[np.float64]

SPEED = 1.0  # [m/s]

_LOOKS = 1.0  # time between two poses of a robot that drives [s]

_ROBOT = replace(SMALL_ROBOT, max_speed=SPEED / MEAN_SPEED_SHARE)
"""Its drives take what a robot without experience assumes, so nothing is left to learn."""


class TabledLengths:
    """Path lengths between the places of an instance, and from the ways between them.

    Args:
        places: Every place.
        goals: The first of them, to which paths lead.
        lengths: (places, goals) [m].
    """

    def __init__(self, places: Sequence[Pose], goals: int, lengths: Floats) -> None:
        self._number = {(pose.x, pose.y): index for index, pose in reversed([*enumerate(places)])}
        self._goals = goals
        self._lengths = lengths
        self._ways: dict[tuple[float, float], tuple[Pose, float]] = {}

    def set_out(self, here: Pose, goal: Pose, left: float) -> None:
        """Note that a pose is on the way to a goal that is a distance away [m]."""
        if (here.x, here.y) not in self._number:  # the lengths from places are known
            self._ways[here.x, here.y] = goal, left

    def length(self, start: Pose, goal: Pose) -> float:
        """Return the length of the path [m]."""
        if (start.x, start.y) in self._ways:
            onward, left = self._ways[start.x, start.y]
            return left + self.length(onward, goal)
        here, there = self._number[start.x, start.y], self._number[goal.x, goal.y]
        if here == there:
            return 0.0
        if there >= self._goals:
            here, there = there, here
        return float(self._lengths[here, there])

    def length_and_delay(self, start: Pose, goal: Pose) -> tuple[float, float]:
        """Return the length of the path [m], and no delay."""
        return self.length(start, goal), 0.0

    def columns(
        self, starts: Sequence[Pose], goals: Sequence[Pose]
    ) -> Iterator[tuple[Floats, Floats, float]]:
        """Yield the lengths of the paths from all starts [m] for each goal, known before."""
        ways = [self._ways.get((pose.x, pose.y), (pose, 0.0)) for pose in starts]
        nodes = np.array([self._number[pose.x, pose.y] for pose, _ in ways])
        left = np.array([way for _, way in ways])
        for goal in goals:
            column: Floats = self._lengths[nodes, self._number[goal.x, goal.y]] + left
            yield column, np.zeros_like(column), 0.0

    def wanted(self, ways: Sequence[Sequence[Pose]]) -> None:
        """Return None: all lengths are known."""

    def refusal(self, pose: Pose) -> str:  # noqa: ARG002  (the port's argument)
        """Return an empty text: every place is free."""
        return ""


@dataclass
class Run:
    """What came of the tasks of one instance.

    Attributes:
        done: Time from posting to done of each task [s]; infinite if it was not.
        makespan: Time until all were done [s].
        late_beats: Heartbeats that came later than twice their period after the one before.
        first: Time from posting to the first assignment of each task [s].
        way: What all robots have driven [m].
        given: How often tasks were given to a robot; at least once each.
        returned: How many tasks went back to a robot that they had left.
        processor: Time that the processor took, for all members, from the first posting until
            every task was assigned once [s].
    """

    done: Floats
    makespan: float
    late_beats: int
    first: Floats
    way: float
    given: int
    returned: int
    processor: float


def run_hive(
    places: Places,
    kind: str,
    cost_model: str,
    settings: BlackboardSettings,
    posted: Sequence[float] | None = None,
    *,
    limit: float = 20_000.0,
) -> Run:
    """Let a hive do the tasks of an instance.

    Args:
        places: Where robots and tasks are.
        kind: One of `KINDS`.
        cost_model: What robots bid by.
        settings: Of the blackboard.
        posted: When each task is posted [s]; by default all at once.
        limit: The longest time that it may take [s].
    """
    table = TabledLengths(*places.table)
    hive = Hive(settings, path_lengths=table)
    drives: list[float] = []
    for number, pose in enumerate(places.robots):
        _add_robot(hive, f"robot{number + 1}", pose, cost_model, table, drives)
    hive.network.run(1.0)
    began = hive.network.now
    tasks = tasks_of(places, kind)
    times = [0.0] * len(tasks) if posted is None else posted
    at = {task.id: began + when for task, when in zip(tasks, times, strict=True)}
    ended: dict[str, float] = {}
    assigned: dict[str, float] = {}
    takers: dict[str, list[str]] = {}
    beats: list[float] = []
    took = [math.inf]
    began_work = time.process_time()

    def note(update: TaskUpdate) -> None:
        if update.state is TaskState.DONE:
            ended.setdefault(update.task_id, hive.network.now)
        elif update.state is TaskState.ASSIGNED:
            assigned.setdefault(update.task_id, hive.network.now)
            takers.setdefault(update.task_id, []).append(update.robot_id)
            if len(assigned) == len(tasks) and math.isinf(took[0]):
                took[0] = time.process_time() - began_work

    hive.network.listen(TASK_STATE, note)
    hive.network.listen(BACKUP, lambda _: beats.append(hive.network.now))
    for task in tasks:
        hive.network.schedule(at[task.id] - began, partial(hive.post, task))
    while len(ended) < len(tasks) and hive.network.now - began < limit:
        hive.network.run(5.0)
        hive.network.sent.clear()
        hive.network.heard.clear()
    done = np.array([ended.get(task.id, math.inf) - at[task.id] for task in tasks])
    last = max(ended.values(), default=math.inf) - began
    gaps = np.diff(beats)
    late = int((gaps > 2 * RaftSettings().heartbeat).sum())
    first = np.array([assigned.get(task.id, math.inf) - at[task.id] for task in tasks])
    return Run(done, last, late, first, sum(drives), *moves_in(takers.values()), took[0])


def moves_in(takers: Iterable[Sequence[str]]) -> tuple[int, int]:
    """Return how often tasks were given to a robot, and how many came back to one.

    Args:
        takers: Of each task, the robots that were told to have it; the same one may be told twice.
    """
    chains = [[name for name, _ in itertools.groupby(names)] for names in takers]
    return sum(map(len, chains)), sum(len(chain) > len(set(chain)) for chain in chains)


def tasks_of(places: Places, kind: str) -> list[Task]:
    """Return the tasks of an instance."""
    if kind == "go":
        return [Task(f"T{n}", TaskType.GA, (start,)) for n, start in enumerate(places.starts)]
    pairs = zip(places.starts, places.ends, strict=True)
    return [Task(f"T{n}", TaskType.GAB, pair) for n, pair in enumerate(pairs)]


def _add_robot(
    hive: Hive,
    name: str,
    pose: Pose,
    cost_model: str,
    table: TabledLengths,
    drives: list[float],
) -> None:
    robot = hive.add_robot(name, pose, _ROBOT, path_lengths=table, cost_model=cost_model)
    command = hive.commands[name]

    def duration(step: TaskStep) -> float:
        here = robot.status.pose
        whole = table.length(here, step.goal)
        drives.append(whole)
        if whole > 0.0:
            _drive(hive, lambda: command.running is step, robot.set_pose, table, here, step, whole)
        return whole / SPEED

    command.duration = duration


def _drive(
    hive: Hive,
    goes_on: Callable[[], bool],
    set_pose: Callable[[Pose], None],
    table: TabledLengths,
    start: Pose,
    step: TaskStep,
    whole: float,
) -> None:
    """Tell a robot where it is while it drives."""
    began = hive.network.now

    def look() -> None:
        share = (hive.network.now - began) * SPEED / whole
        if not goes_on() or share >= 1.0:
            return
        goal = step.goal
        here = Pose(
            start.x + share * (goal.x - start.x), start.y + share * (goal.y - start.y), start.yaw
        )
        table.set_out(here, goal, (1.0 - share) * whole)
        set_pose(here)
        hive.network.schedule(_LOOKS, look)

    hive.network.schedule(_LOOKS, look)
