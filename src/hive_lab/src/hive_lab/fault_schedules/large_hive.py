# SPDX-License-Identifier: BSD-3-Clause
"""Hives of any size that run until every task has ended, with all properties checked.

The blackboard node and the first robots are members with a vote. The other robots have no member
beside them and follow the task list on `bb_sync`.
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
from blackboard.domain.talker import BACKUP, BB_VOTE
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose
from hive_lab.fault_schedules.faulty_network import FaultyNetwork, HostTalker
from hive_lab.fault_schedules.harness import Harness
from hive_lab.fault_schedules.history import Violation
from hive_lab.fault_schedules.schedule import BLACKBOARD, SETTLE, Crash
from hive_lab.fault_schedules.simulated_member import Disk, SimulatedMember

if TYPE_CHECKING:
    from blackboard.consensus.messages import Heartbeat
    from blackboard.domain.talker import Talker
    from hive_lab.fault_schedules.faulty_network import Host

_ROOM = 10.0  # side of the floor area for each robot, so that larger fleets are no denser [m]
_POSTING = 30.0  # all tasks are posted within this time [s]

_CRASH, _BACK = 20.0, 5.0
"""When the blackboard node crashes after the first task, and for how long [s]."""

_LIMIT = 3600.0  # every task has to end by then [s]


@dataclass(frozen=True)
class LargeHiveResult:
    """The result.

    Attributes:
        violation: The property that broke; empty if none did.
        ended: Number of tasks by terminal state.
        lasted: When the last task ended [s].
        sent: Number of published messages by topic.
        events: Number of delivered messages, timers and drives.
        takeovers: How often a member became leader.
        longest_list: The most tasks on the list.
    """

    violation: str
    ended: Counter[str]
    lasted: float
    sent: Counter[str]
    events: int
    takeovers: int
    longest_list: int


class _Listener(NoFilter):
    """Learns the leader from heartbeats, so that a robot sends only to possible leaders."""

    def __init__(self, talker: Talker) -> None:
        super().__init__(talker)
        talker.subscribe(BACKUP, self._hear)

    def _hear(self, beat: Heartbeat) -> None:
        self.leader = (beat.leader,)
        self.carriers = (beat.leader, beat.backup)


@dataclass
class _LoneRobot(SimulatedMember):
    """A robot without a member beside it."""

    def boot(self) -> None:
        """Start the process."""
        self.host.boot()
        self.host.handlers[BB_VOTE] = []  # like members, it gets only messages for it
        talker = HostTalker(self.host, self.name)
        self._robot(talker, _Listener(talker)).start()


class LargeHive(Harness):
    """A hive of at least 2 robots with at least 1 task; the seed decides every chance."""

    def __init__(self, robots: int, tasks: int, seed: int) -> None:
        super().__init__(FaultyNetwork(Random(seed)))
        self._side = _ROOM * sqrt(robots)
        settings = RaftSettings()
        names = [BLACKBOARD, *(f"robot{number + 1}" for number in range(robots))]
        voters, others = names[: settings.most_members], names[settings.most_members :]
        members = {name: self._add(SimulatedMember, name, settings) for name in voters}
        self._robots = [self._add(_LoneRobot, name, settings) for name in others]
        self._tasks = [self._task(number + 1) for number in range(tasks)]
        self._sent: Counter[str] = Counter()
        self._longest = 0
        self.connect(members, self._tasks)
        self.network.said = self._note

    def run(self) -> LargeHiveResult:
        """Run until every task has ended; a violation ends it early."""
        violation = ""
        self.start([*self.members.values(), *self._robots])
        for task in self._tasks:
            at = SETTLE + self.random.uniform(0.0, _POSTING)
            self.network.schedule(at, None, self.post, task)
        crash = Crash(SETTLE + _CRASH, BLACKBOARD, _BACK)
        self.network.schedule(crash.at, None, self.injector.happen, crash)
        ending = self.checker.ending
        try:
            self.network.run(SETTLE + _POSTING)
            while self.network.now < _LIMIT and not ending.is_over():
                self.network.run(self.network.now + 1.0)
            ending.check()
        except Violation as broken:
            violation = str(broken)
        return LargeHiveResult(
            violation,
            Counter(record.state.name for record in ending.truth.values()),
            self.network.now,
            self._sent,
            self.network.events,
            self.checker.takeovers,
            self._longest,
        )

    def _add(
        self, kind: type[SimulatedMember], name: str, settings: RaftSettings
    ) -> SimulatedMember:
        host = self.network.add_host(name)
        own = Random(self.random.random())
        return kind(host, Disk(), self._place(), own, settings, BlackboardSettings())

    def _place(self) -> Pose:
        return Pose(self.random.uniform(0.0, self._side), self.random.uniform(0.0, self._side))

    def _task(self, number: int) -> Task:
        kind = self.random.choice(list(TaskType))
        goals = tuple(self._place() for _ in range(kind.goals_needed))
        priority, payload = self.random.choice([0, 0, 5, 9]), self.random.uniform(0.0, 5.0)
        return Task(f"T{number}", kind, goals, priority, payload)

    def _note(self, host: Host, topic: str, message: object) -> None:
        self._sent[topic] += 1
        if isinstance(message, TaskList):
            self._longest = max(self._longest, len(message.records))
        self.checker.said(host, topic, message)
