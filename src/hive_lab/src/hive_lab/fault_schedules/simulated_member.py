# SPDX-License-Identifier: BSD-3-Clause
"""A hive of the real classes on the simulated network, and what a schedule does to it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from blackboard.board.blackboard import Blackboard
from blackboard.consensus.journal import MemoryJournal
from blackboard.consensus.node import RaftNode
from blackboard.costing.path_lengths import EuclideanLengths
from blackboard.domain.battery import Battery
from blackboard.domain.settings import ControllerSettings, RobotSettings
from blackboard.domain.talker import BB_VOTE
from blackboard.domain.task import StepKind
from blackboard.robot.controller import CommandResult, CommandState, Controller
from blackboard.robot.robot import Robot
from hive_lab.fault_schedules.faulty_network import HostTalker, SimulatedCrashError
from hive_lab.fault_schedules.schedule import BLACKBOARD, WritePoint
from hive_lab.virtual.hive import SMALL_ROBOT

if TYPE_CHECKING:
    from collections.abc import Callable
    from random import Random

    from blackboard.consensus.hive_filter import HiveFilter
    from blackboard.consensus.journal import HardState
    from blackboard.domain.settings import BlackboardSettings, RaftSettings
    from blackboard.domain.task import TaskStep
    from hive_common.pose import Pose
    from hive_lab.fault_schedules.faulty_network import Host

CONTROLLER_SETTINGS = ControllerSettings(retry_delay=1.0)

_FAILURES = 0.05
"""Share of the steps that a simulated drive does not manage."""


@dataclass
class Disk(MemoryJournal):
    """A disk that survives its host's crash, and at one of whose writes the host may crash.

    Attributes:
        crashes: Whether the host crashes at the next write, before anything is written.
        watched_by: Told what was written before and what is going to be written now; says whether
            and when the host crashes.
    """

    crashes: bool = False
    watched_by: Callable[[HardState | None, HardState], WritePoint] = lambda *_: WritePoint.AFTER

    def save(self, hard_state: HardState) -> None:
        """Write down, or end before anything is written, or right afterwards.

        Raises:
            SimulatedCrashError: The host crashes now.
        """
        point = self.watched_by(self.hard_state, hard_state)
        if self.crashes or point is WritePoint.BEFORE_WRITING:
            self.crashes = False
            raise SimulatedCrashError
        self.hard_state = hard_state
        if point is WritePoint.BEFORE_SAYING:
            raise SimulatedCrashError


class Drive:
    """Does the steps of one robot, each in a few seconds; see `blackboard.robot.controller.Command`.

    Attributes:
        at_work: Told when the robot begins and stops to work on a task.
        step_done: Told of every step that has been done.
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
        """Turn the wheels again after a freeze, unless it has been stopped meanwhile."""
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
        done(CommandResult(state, "" if works else "somebody stood in the way"))


@dataclass
class SimulatedMember:
    """One member of the hive: its host, its disk, and what runs there now.

    Attributes:
        host: The machine.
        disk: Survives crashes, unless it is lost.
        settings: The hive's timers.
        board: How patient its blackboard is.
        backup: Of the process that runs now; None while none does.
        pose: Where the robot stands; it stays where it is when its process ends.
        gone: Whether it never comes back.
        stands_by: Whether it would carry the blackboard.
        drive: Of the robot that runs now, if there is one.
    """

    host: Host
    disk: Disk
    pose: Pose
    random: Random
    settings: RaftSettings
    board: BlackboardSettings
    backup: RaftNode | None = None
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
        founds = self.name == BLACKBOARD
        self.backup = RaftNode(
            talker,
            self.name,
            self.settings,
            self.disk,
            self.random,
            founds=founds,
            voter=self.voter,
        )
        if self.voter:
            Blackboard(talker, self.backup, EuclideanLengths(), self.board).start()
        else:
            host.handlers[BB_VOTE] = []  # as members do, it hears only what concerns it
        try:
            if self.name != BLACKBOARD:
                self._robot(talker, self.backup).start()
            self.backup.start()
        except SimulatedCrashError:
            host.crash()

    def _robot(self, talker: HostTalker, fence: HiveFilter) -> Robot:
        def arrive(pose: Pose) -> None:
            self.pose = pose
            robot.set_pose(pose)

        drive = self.drive = Drive(self.host, self.random, arrive)
        drive.at_work = lambda task, works: self.at_work(self.name, task, works)
        drive.step_done = lambda step: self.step_done(self.name, step)
        controller = Controller(dict.fromkeys(StepKind, drive), talker, CONTROLLER_SETTINGS)
        battery = Battery(SMALL_ROBOT.battery, 1.0)
        robot = Robot(
            talker,
            self.name,
            SMALL_ROBOT,
            battery,
            EuclideanLengths(),
            controller,
            self.pose,
            RobotSettings(),
            self.disk,
            fence,
        )
        return robot
