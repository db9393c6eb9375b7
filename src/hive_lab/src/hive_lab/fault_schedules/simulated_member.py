# SPDX-License-Identifier: BSD-3-Clause
"""Members of a hive of the real classes on the faulty network, with disks and drives."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from blackboard.board.blackboard import Blackboard
from blackboard.consensus.journal import MemoryJournal
from blackboard.consensus.node import RaftNode
from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.domain.settings import ControllerSettings
from blackboard.domain.talker import BB_VOTE
from blackboard.domain.task import StepKind
from blackboard.robot.executor import CommandResult, CommandState
from hive_lab.fault_schedules.faulty_network import HostTalker, SimulatedCrashError
from hive_lab.fault_schedules.schedule import BLACKBOARD, WritePoint
from hive_lab.virtual.hive import make_robot

if TYPE_CHECKING:
    from collections.abc import Callable
    from random import Random

    from blackboard.consensus.hive_filter import HiveFilter
    from blackboard.consensus.journal import HardState
    from blackboard.domain.settings import BlackboardSettings, RaftSettings
    from blackboard.domain.task import TaskStep
    from blackboard.robot.robot import Robot
    from hive_common.pose import Pose
    from hive_lab.fault_schedules.faulty_network import Host

CONTROLLER_SETTINGS = ControllerSettings(retry_delay=1.0)

_FAILURES = 0.05  # share of the steps that fail


@dataclass
class Disk(MemoryJournal):
    """A disk that survives its host's crash; the host may crash at a write.

    Attributes:
        crashes: Whether the host crashes at the next write, before anything is written.
        watched_by: Gets the state before and after a write; returns whether and when to crash.
    """

    crashes: bool = False
    watched_by: Callable[[HardState | None, HardState], WritePoint] = lambda *_: WritePoint.AFTER

    def save(self, hard_state: HardState) -> None:
        """Write, unless the host crashes before the write, or crash right after it."""
        point = self.watched_by(self.hard_state, hard_state)
        if self.crashes or point is WritePoint.BEFORE_WRITING:
            self.crashes = False
            raise SimulatedCrashError
        self.hard_state = hard_state
        if point is WritePoint.BEFORE_SAYING:
            raise SimulatedCrashError


class Drive:
    """One robot's steps, each a few seconds; see `blackboard.robot.executor.Command`.

    Attributes:
        at_work: Called when the robot begins or stops working on a task.
        step_done: Called after every completed step.
    """

    def __init__(self, host: Host, random: Random, arrive: Callable[[Pose], None]) -> None:
        self._host = host
        self._random = random
        self._arrive = arrive
        self._run = 0
        self._task = ""
        self._runs = False
        self.at_work: Callable[[str, bool], None] = lambda *_: None
        self.step_done: Callable[[TaskStep], None] = lambda _: None

    def start(self, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        """Begin a step."""
        self._run += 1
        self._task = step.task_id
        self._runs = True
        self.at_work(self._task, True)
        duration = self._random.uniform(0.5, 4.0)
        works = self._random.random() >= _FAILURES
        self._host.network.schedule(
            duration, self._host, self._end, (self._run, step, works, done)
        )

    def cancel(self) -> None:
        """Stop."""
        self._run += 1
        self._runs = False
        self.at_work(self._task, False)

    def go_on(self) -> None:
        """Turn the wheels again after a freeze, unless the drive was cancelled meanwhile."""
        if self._runs:
            self.at_work(self._task, True)

    def _end(self, what: tuple[int, TaskStep, bool, Callable[[CommandResult], None]]) -> None:
        run, step, works, done = what
        if run != self._run:
            return
        self._runs = False
        self.at_work(self._task, False)
        if works:
            self._arrive(step.goal)
            self.step_done(step)
        state = CommandState.SUCCEEDED if works else CommandState.ABORTED
        done(CommandResult(state, "" if works else "path blocked"))


@dataclass
class SimulatedMember:
    """One member: its host, its disk, and the process that runs there now.

    Attributes:
        disk: Survives crashes, unless a fault takes it.
        pose: Where the robot stands, also while its process is down.
        node: Of the running process, if any.
        drive: Of the running robot, if any.
        gone: Whether the member never comes back.
        voter: Whether it is a voter rather than a learner.
    """

    host: Host
    disk: Disk
    pose: Pose
    random: Random
    settings: RaftSettings
    board: BlackboardSettings
    node: RaftNode | None = None
    drive: Drive | None = None
    gone: bool = False
    voter: bool = True
    at_work: Callable[[str, str, bool], None] = field(default=lambda *_: None)
    step_done: Callable[[str, TaskStep], None] = field(default=lambda *_: None)

    @property
    def name(self) -> str:
        """Its name."""
        return self.host.name

    def boot(self) -> None:
        """Start the process."""
        host = self.host
        host.boot()
        talker = HostTalker(host, self.name)
        self.node = RaftNode(
            talker,
            self.name,
            self.settings,
            self.disk,
            self.random,
            bootstrap=self.name == BLACKBOARD,
            voter=self.voter,
        )
        if self.voter:
            Blackboard(talker, self.node, EuclideanLengths(), self.board).start()
        else:
            host.handlers[BB_VOTE] = []  # like members, it gets only messages for it
        try:
            if self.name != BLACKBOARD:
                self._robot(talker, self.node).start()
            self.node.start()
        except SimulatedCrashError:
            host.crash()

    def _robot(self, talker: HostTalker, hive_filter: HiveFilter) -> Robot:
        def arrive(pose: Pose) -> None:
            self.pose = pose
            robot.set_pose(pose)

        drive = self.drive = Drive(self.host, self.random, arrive)
        drive.at_work = lambda task, works: self.at_work(self.name, task, works)
        drive.step_done = lambda step: self.step_done(self.name, step)
        robot = make_robot(
            talker,
            self.name,
            self.pose,
            dict.fromkeys(StepKind, drive),
            controller=CONTROLLER_SETTINGS,
            journal=self.disk,
            hive_filter=hive_filter,
        )
        return robot
