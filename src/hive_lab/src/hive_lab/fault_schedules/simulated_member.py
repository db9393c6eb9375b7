# SPDX-License-Identifier: BSD-3-Clause
"""Members of a hive of the real classes on the faulty network, with disks and drives."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from blackboard.board.blackboard import Blackboard
from blackboard.consensus.journal import MemoryJournal
from blackboard.consensus.node import RaftNode
from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.domain.battery import Battery
from blackboard.domain.record import Hold
from blackboard.domain.settings import ControllerSettings
from blackboard.domain.talker import BB_VOTE, SET_STATE
from blackboard.domain.task import StepKind
from blackboard.errors import JournalError
from blackboard.robot.executor import CommandResult, CommandState
from hive_lab.fault_schedules.faulty_network import HostTalker, SimulatedCrashError
from hive_lab.fault_schedules.features.kit import RobotKit
from hive_lab.fault_schedules.schedule import BLACKBOARD, WritePoint
from hive_lab.fault_schedules.simulated_arm import SimulatedArm
from hive_lab.fault_schedules.simulated_base import SimulatedBase
from hive_lab.virtual.hive import make_robot
from hive_lab.virtual.inline_searcher import InlineSearcher

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from random import Random

    from blackboard.consensus.hive_filter import HiveFilter
    from blackboard.consensus.journal import HardState
    from blackboard.domain.record import TaskUpdate
    from blackboard.domain.settings import BlackboardSettings, RaftSettings
    from blackboard.domain.task import TaskStep
    from blackboard.robot.robot import Robot
    from hive_common.pose import Pose
    from hive_lab.fault_schedules.faulty_network import Host

CONTROLLER_SETTINGS = ControllerSettings(retry_delay=1.0)

_FAILURES = 0.05  # share of the steps that fail
_STALLED = 30.0  # a step that stalls takes this long [s]


@dataclass
class Disk(MemoryJournal):
    """A disk that survives its host's crash; the host may crash at a write.

    Attributes:
        crashes: Whether the host crashes at the next write, before anything is written.
        full: Whether nothing can be written.
        takes: How long each write holds the process up [s].
        lag: A write survives a loss of power only so long after it was confirmed [s].
        now: Returns the true time [s].
        hold_up: Called with the time that a write takes [s].
        filled_up: Whether a report could not be written of a step that began while there was room.
        watched_by: Gets the state before and after a write; returns whether and when to crash.
    """

    crashes: bool = False
    full: bool = False
    takes: float = 0.0
    lag: float = 0.0
    filled_up: bool = False
    _had_room: bool = True
    _cached: list[tuple[float, HardState | None, tuple[TaskUpdate, ...], Hold]] = field(
        default_factory=list
    )  # until when a write is in the disk's cache only, and what was there before
    now: Callable[[], float] = lambda: 0.0
    hold_up: Callable[[float], None] = lambda _: None
    watched_by: Callable[[HardState | None, HardState], WritePoint] = lambda *_: WritePoint.AFTER

    def save(self, hard_state: HardState) -> None:
        """Write, unless the host crashes before the write, or crash right after it."""
        self._write()
        point = self.watched_by(self.hard_state, hard_state)
        if self.crashes or point is WritePoint.BEFORE_WRITING:
            self.crashes = False
            raise SimulatedCrashError
        self.hard_state = hard_state
        if point is WritePoint.BEFORE_SAYING:
            raise SimulatedCrashError

    def save_reports(self, reports: Iterable[TaskUpdate]) -> None:
        """Write the reports, unless the disk is full."""
        self.filled_up = self.full and self._had_room
        self._write()
        super().save_reports(reports)

    def begin_step(self) -> None:
        """Note whether there is room while a step begins."""
        self._had_room = not self.full

    def save_hold(self, hold: Hold) -> None:
        """Write what may be on board, unless the disk is full."""
        self._write()
        super().save_hold(hold)

    def _write(self) -> None:
        if self.full:
            raise JournalError("no space left on device")
        if self.takes:
            self.hold_up(self.takes)
        if self.lag:
            now = self.now()
            self._cached = [each for each in self._cached if each[0] > now]
            self._cached.append((now + self.lag, self.hard_state, self.reports, self.hold))

    def lose(self) -> None:
        """Be replaced by an empty disk."""
        self.hard_state, self.reports, self.hold, self.home = None, (), Hold(), None
        self._cached = []

    @property
    def after_power_loss(self) -> HardState | None:
        """The hard state that is left if the power fails now."""
        now = self.now()
        return next((state for until, state, *_ in self._cached if until > now), self.hard_state)

    def lose_power(self) -> bool:
        """Lose what is in the cache only; return whether that is anything."""
        now = self.now()
        lost = [each for each in self._cached if each[0] > now]
        self._cached = []
        if lost:
            _, self.hard_state, self.reports, self.hold = lost[0]
        return bool(lost)


class Drive:
    """One robot's steps, each a few seconds; see `blackboard.robot.executor.Command`.

    The steps are done by `SimulatedBase` and `SimulatedArm`, which are processes of their own.

    Args:
        arrive: Called with the goal of every step of the arm that is completed.

    Attributes:
        stalls: Share of the steps that stall.
        at_work: Called when the robot begins or stops working on a task.
        step_done: Called after every completed step.
    """

    def __init__(
        self,
        host: Host,
        random: Random,
        arrive: Callable[[Pose], None],
        base: SimulatedBase,
        arm: SimulatedArm,
        stalls: float = 0.0,
    ) -> None:
        self._host = host
        self._base = base
        self._arm = arm
        self._random = random
        self._arrive = arrive
        self.stalls = stalls
        self._run = 0
        self._arms_step: TaskStep | None = None
        self.at_work: Callable[[TaskStep, bool], None] = lambda *_: None
        self.step_done: Callable[[TaskStep], None] = lambda _: None

    def start(self, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        """Begin a step."""
        self._run += 1
        run = self._run

        def end(result: CommandResult) -> None:
            self._end((run, step, result, done))

        if step.kind is not StepKind.MOVE:
            self._arms_step = step
            self.at_work(step, True)
        if (known := self._arm.knows(step)) is not None:
            self._host.network.schedule(0.0, self._host, end, known)
            return
        if self._arm.is_at(step):
            self._arm.join(end)
            return
        duration = self._random.uniform(0.5, 4.0)
        works = self._random.random() >= _FAILURES
        if self.stalls and self._random.random() < self.stalls:
            duration = _STALLED
        if step.kind is StepKind.MOVE:
            self._base.start(step, duration, end, works=works)
        else:
            self._arm.start(step, duration, end, works=works)

    def cancel(self) -> None:
        """Stop driving."""
        self._run += 1
        self._base.cancel()

    def cancel_arm(self) -> None:
        """Stop the arm, whoever has started it."""
        self._run += self._arms_step is not None
        self._arm.cancel()
        self._rest()

    def go_on(self) -> None:
        """Work with the arm again after a freeze, unless it was told to stop meanwhile."""
        if self._arms_step is not None:
            self.at_work(self._arms_step, True)

    def _end(
        self, what: tuple[int, TaskStep, CommandResult, Callable[[CommandResult], None]]
    ) -> None:
        run, step, result, done = what
        if run != self._run:
            return
        self._rest()
        if result.state is CommandState.SUCCEEDED:
            if step.kind is not StepKind.MOVE:
                self._arrive(step.goal)
            self.step_done(step)
        done(result)

    def _rest(self) -> None:
        step, self._arms_step = self._arms_step, None
        if step is not None:
            self.at_work(step, False)


class ArmSteps:
    """The arm's part of a robot's steps."""

    def __init__(self, drive: Drive) -> None:
        self.start = drive.start
        self.cancel = drive.cancel_arm


@dataclass
class SimulatedMember:
    """One member: its host, its disk, and the process that runs there now.

    Attributes:
        disk: Survives crashes, unless a fault takes it.
        pose: Where the robot stands, also while its process is down.
        node: Of the running process, if any.
        drive: Of the running robot, if any.
        base: Of its robot; it outlives the process, like the arm.
        arm: Of its robot.
        gone: Whether the member never comes back.
        voter: Whether it is a voter rather than a learner.
        kit: What its robot is.
        battery: Of its robot; it is as full after a crash as before.
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
    kit: RobotKit = field(default_factory=RobotKit)
    battery: Battery = field(init=False)
    base: SimulatedBase = field(init=False)
    arm: SimulatedArm = field(init=False)
    at_work: Callable[[str, TaskStep, bool], None] = field(default=lambda *_: None)
    step_done: Callable[[str, TaskStep], None] = field(default=lambda *_: None)
    heads_for: Callable[[str, Pose | None], None] = field(default=lambda *_: None)

    def __post_init__(self) -> None:
        self.battery = Battery(self.kit.characteristics.battery, self.kit.charge)
        self.base = SimulatedBase(self.host)
        self.arm = SimulatedArm(self.host)
        self.disk.hold_up = self.host.hold_up
        self.disk.now = lambda: self.host.network.now

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
            Blackboard(
                talker,
                self.node,
                EuclideanLengths(),
                self.board,
                searcher=InlineSearcher(talker),
            ).start()
        else:
            host.handlers[BB_VOTE] = []  # like members, it gets only messages for it
        try:
            if self.name != BLACKBOARD:
                self._robot(talker, self.node).start()
            self.node.start()
        except SimulatedCrashError:
            host.crash()

    def _robot(self, talker: HostTalker, hive_filter: HiveFilter) -> Robot:
        kit = self.kit

        def arrive(pose: Pose) -> None:
            distance = self.pose.distance_to(pose)
            self.pose = pose
            robot.set_pose(pose)
            if kit.charging.chargers:
                robot.add_travel(distance)

        base, arm = self.base, self.arm
        drive = self.drive = Drive(self.host, self.random, arrive, base, arm, kit.stalls)

        def at_work(step: TaskStep, works: bool) -> None:
            if works:
                self.disk.begin_step()
            self.at_work(self.name, step, works)

        base.at_work = drive.at_work = at_work
        base.arrive = arrive
        base.heads_for = lambda goal: self.heads_for(self.name, goal)
        drive.step_done = lambda step: self.step_done(self.name, step)
        robot = make_robot(
            talker,
            self.name,
            self.pose,
            dict.fromkeys(StepKind, ArmSteps(drive)) | {StepKind.MOVE: drive},
            kit.characteristics,
            battery=self.battery,
            controller=CONTROLLER_SETTINGS,
            settings=kit.settings,
            charging=kit.charging,
            journal=self.disk,
            hive_filter=hive_filter,
        )

        robot.tell_lease_to(base.hold_until)

        def empty(word: str) -> None:
            # Only a person who was told of the load takes it off.
            if word == "idle" and "take it off" in robot.status.reason:
                self.arm.take_off()

        talker.subscribe(SET_STATE, empty)
        return robot
