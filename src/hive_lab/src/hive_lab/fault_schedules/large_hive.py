# SPDX-License-Identifier: BSD-3-Clause
"""Hives of any size that do their tasks to the end, with all properties checked.

The blackboard node and the first robots are the members that have a vote. The other robots are
robots only: they hear the list on `bb_sync`, which is what robots without a member beside them do.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from math import sqrt
from random import Random
from typing import TYPE_CHECKING

from blackboard.consensus.hive_filter import NoFilter
from blackboard.consensus.task_list import TaskList
from blackboard.domain.settings import BlackboardSettings, RaftSettings
from blackboard.domain.talker import BACKUP, BB_VOTE, NEW_TASK, TASK_STATE
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose
from hive_lab.fault_schedules.faulty_network import FaultyNetwork, HostTalker
from hive_lab.fault_schedules.history import Violation
from hive_lab.fault_schedules.injector import FaultInjector
from hive_lab.fault_schedules.protocol_checker import ProtocolChecker
from hive_lab.fault_schedules.schedule import BLACKBOARD, OPERATOR, SETTLE, Crash
from hive_lab.fault_schedules.simulated_member import Disk, SimulatedMember

if TYPE_CHECKING:
    from blackboard.consensus.messages import Heartbeat
    from blackboard.domain.record import TaskUpdate
    from blackboard.domain.talker import Talker
    from hive_lab.fault_schedules.faulty_network import Host

_ROOM = 10.0
"""Each robot has a square of that side to itself, so that large fleets are no denser [m]."""

_POSTING = 30.0
"""All tasks are posted within that time [s]."""

_CRASH, _BACK = 20.0, 5.0
"""The blackboard node crashes that long after the first task, and is back after that [s]."""

_REPEAT = 1.5
"""What has not been answered is posted again after that time [s]."""

_LIMIT = 3600.0
"""By then all has to have ended [s]."""


@dataclass(frozen=True)
class LargeHiveResult:
    """What came of it.

    Attributes:
        violation: The property that was broken; empty where none was.
        ended: How many tasks ended in which state.
        lasted: Until the last task had ended [s].
        sent: Messages that were published, by topic.
        events: Messages that were handed over, timers and drives.
        takeovers: How often a member became active.
        longest_list: Tasks on the list at most.
    """

    violation: str
    ended: Counter[str]
    lasted: float
    sent: Counter[str]
    events: int
    takeovers: int
    longest_list: int


class _Onlooker(NoFilter):
    """Knows who carries the blackboard by listening, so that a robot tells only those."""

    def __init__(self, talker: Talker) -> None:
        super().__init__(talker)
        talker.subscribe(BACKUP, self._hear)

    def _hear(self, beat: Heartbeat) -> None:
        self.leader = (beat.leader,)
        self.carriers = (beat.leader, beat.backup)


@dataclass
class _LoneRobot(SimulatedMember):
    """A robot that has no member of the hive beside it."""

    def boot(self) -> None:
        """Start the process."""
        self.host.boot()
        self.host.handlers[BB_VOTE] = []  # as members do, it hears only what concerns it
        talker = HostTalker(self.host, self.name)
        self._robot(talker, _Onlooker(talker)).start()


class LargeHive:
    """A hive of many robots.

    Args:
        robots: How many, at least 2.
        tasks: How many, at least 1.
        seed: Of all chances.
    """

    def __init__(self, robots: int, tasks: int, seed: int) -> None:
        self._random = Random(seed)
        self._side = _ROOM * sqrt(robots)
        self._network = FaultyNetwork(self._random)
        settings = RaftSettings()
        names = [BLACKBOARD, *(f"robot{number + 1}" for number in range(robots))]
        voters, others = names[: settings.most_members], names[settings.most_members :]
        self._members = {name: self._add(SimulatedMember, name, settings) for name in voters}
        self._robots = [self._add(_LoneRobot, name, settings) for name in others]
        self._tasks = [self._task(number + 1) for number in range(tasks)]
        self._properties = ProtocolChecker(self._members, self._tasks, lambda: self._network.now)
        self._injector = FaultInjector(self._network, self._members, self._properties)
        self._network.after_event = self._properties.after_event
        self._network.said = self._note
        self._sent: Counter[str] = Counter()
        self._longest = 0
        self._answered: set[str] = set()
        self._operator = self._network.add_host(OPERATOR)
        self._operator.up = True
        self._operator.handlers[TASK_STATE] = [self._hear]

    def run(self) -> LargeHiveResult:
        """Let all tasks be posted and done; a broken property ends it."""
        violation = ""
        for each in (*self._members.values(), *self._robots):
            each.at_work, each.step_done = self._properties.at_work, self._properties.step_done
            self._network.schedule(self._random.uniform(0.0, 1.0), None, self._boot, each)
        for task in self._tasks:
            at = SETTLE + self._random.uniform(0.0, _POSTING)
            self._network.schedule(at, None, self._post, task)
        crash = Crash(SETTLE + _CRASH, BLACKBOARD, _BACK)
        self._network.schedule(crash.at, None, self._injector.happen, crash)
        ending = self._properties.ending
        try:
            self._network.run(SETTLE + _POSTING)
            while self._network.now < _LIMIT and not ending.is_over():
                self._network.run(self._network.now + 1.0)
            ending.check()
        except Violation as broken:
            violation = str(broken)
        return LargeHiveResult(
            violation,
            Counter(record.state.name for record in ending.truth.values()),
            self._network.now,
            self._sent,
            self._network.events,
            self._properties.takeovers,
            self._longest,
        )

    def _add(
        self, kind: type[SimulatedMember], name: str, settings: RaftSettings
    ) -> SimulatedMember:
        host = self._network.add_host(name)
        own = Random(self._random.random())
        return kind(host, Disk(), self._place(), own, settings, BlackboardSettings())

    def _boot(self, member: SimulatedMember) -> None:
        member.boot()
        self._properties.after_event(member.host)

    def _place(self) -> Pose:
        return Pose(self._random.uniform(0.0, self._side), self._random.uniform(0.0, self._side))

    def _task(self, number: int) -> Task:
        kind = self._random.choice(list(TaskType))
        goals = tuple(self._place() for _ in range(kind.goals_needed))
        priority, payload = self._random.choice([0, 0, 5, 9]), self._random.uniform(0.0, 5.0)
        return Task(f"T{number}", kind, goals, priority, payload)

    def _post(self, task: Task) -> None:
        if task.id not in self._answered:
            self._network.send(self._operator, NEW_TASK, task)
            self._network.schedule(_REPEAT, None, self._post, task)

    def _hear(self, update: TaskUpdate) -> None:
        self._answered.add(update.task_id)

    def _note(self, host: Host, topic: str, message: object) -> None:
        self._sent[topic] += 1
        if isinstance(message, TaskList):
            self._longest = max(self._longest, len(message.records))
        self._properties.said(host, topic, message)
