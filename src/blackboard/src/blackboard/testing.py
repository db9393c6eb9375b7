# SPDX-License-Identifier: BSD-3-Clause
"""Whole hives in one process on virtual time: a network, robots that only pretend to drive.

Everything here stands in for something real behind a port of the core: `Network` and its talkers
for ROS, `TimedCommand` for an action server. The hives themselves are made of the real classes.
"""

from __future__ import annotations

import heapq
import itertools
import random
from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from blackboard.backup import Backup, founded
from blackboard.battery import Battery, BatteryModel
from blackboard.blackboard import Blackboard
from blackboard.characteristics import RobotCharacteristics
from blackboard.controller import CommandResult, CommandState, Controller
from blackboard.journal import MemoryJournal
from blackboard.robot import Robot
from blackboard.settings import (
    BackupSettings,
    BlackboardSettings,
    ControllerSettings,
    RobotSettings,
)
from blackboard.talker import NEW_TASK, SET_STATE, SYNC, TASK_CANCEL, TASK_STATE
from blackboard.task import StepKind, TaskState
from blackboard.ways import StraightWays

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.backup import TaskList
    from blackboard.pose import Pose
    from blackboard.record import TaskRecord, TaskUpdate
    from blackboard.task import Task, TaskStep
    from blackboard.ways import Ways

LATENCY = 0.001
"""Time that a message takes [s]."""

SMALL_ROBOT = RobotCharacteristics(
    mass=50.0,
    payload=20.0,
    max_speed=1.0,
    friction_coefficient=0.02,
    radius=0.3,
    battery=BatteryModel(
        capacity=20.0, voltage_full=28.0, voltage_empty=22.0, charging_time=3600.0
    ),
    arm_payload=5.0,
    arm_power=100.0,
    pick_duration=5.0,
    place_duration=4.0,
    idle_power=20.0,
)
"""A mobile manipulator; vary it with `dataclasses.replace`."""


@dataclass
class _Call:
    action: Callable[[], None]
    cancelled: bool = False

    def cancel(self) -> None:
        self.cancelled = True


class Network:
    """Virtual time, and the messages under way.

    Attributes:
        now: The time [s].
        heard: Every message in the order of its arrival, with its topic.
    """

    def __init__(self) -> None:
        self.now = 0.0
        self.heard: list[tuple[str, object]] = []
        self._calls: list[tuple[float, int, _Call]] = []
        self._order = itertools.count()
        self._handlers: dict[str, list[Callable[[Any], None]]] = defaultdict(list)

    def schedule(self, delay: float, action: Callable[[], None]) -> _Call:
        """Have something happen after a delay [s]."""
        call = _Call(action)
        heapq.heappush(self._calls, (self.now + delay, next(self._order), call))
        return call

    def send(self, topic: str, message: object) -> None:
        """Hand a message to everyone who listens, after the latency."""
        self.schedule(LATENCY, lambda: self._deliver(topic, message))

    def listen(self, topic: str, handler: Callable[[Any], None]) -> None:
        """Have every message of a topic handed over."""
        self._handlers[topic].append(handler)

    def run(self, duration: float) -> None:
        """Let time pass [s]."""
        end = self.now + duration
        while self._calls and self._calls[0][0] <= end:
            self.now, _, call = heapq.heappop(self._calls)
            if not call.cancelled:
                call.action()
        self.now = end

    def run_until(self, condition: Callable[[], bool], limit: float) -> bool:
        """Let time pass until something is so; return whether it was within a limit [s]."""
        end = self.now + limit
        while not condition():
            if not self._calls or self._calls[0][0] > end:
                self.now = end
                return condition()
            self.now, _, call = heapq.heappop(self._calls)
            if not call.cancelled:
                call.action()
        return True

    def _deliver(self, topic: str, message: object) -> None:
        self.heard.append((topic, message))
        for handler in tuple(self._handlers[topic]):
            handler(message)


class NetworkTalker:
    """One member's talker on a `Network`; see `blackboard.talker.Talker`.

    Attributes:
        warnings: What the member has told the person who runs it.
    """

    def __init__(self, network: Network, member: str) -> None:
        self._network = network
        self._member = member
        self.warnings: list[str] = []

    def now(self) -> float:
        """Return the virtual time [s]."""
        return self._network.now

    def publish(self, topic: str, message: object) -> None:
        """Send a message to everyone who listens, this member included."""
        self._network.send(self._name(topic), message)

    def subscribe(self, topic: str, handler: Callable[[Any], None]) -> None:
        """Have every message of a topic handed over."""
        self._network.listen(self._name(topic), handler)

    def every(self, period: float, action: Callable[[], None]) -> _Call:
        """Call again and again, the first time after one period [s]."""

        def repeat() -> None:
            if not handle.cancelled:
                self._network.schedule(period, repeat)
                action()

        handle = self._network.schedule(period, repeat)
        return handle

    def after(self, delay: float, action: Callable[[], None]) -> _Call:
        """Call once, after a delay [s]."""
        return self._network.schedule(delay, action)

    def ping(self, member: str) -> bool:
        """Return whether there is a member of that name: always, on this network."""
        return bool(member)

    def watch(self, member: str, died: Callable[[], None]) -> None:
        """Watch a member: none of them dies, on this network."""

    def warn(self, text: str) -> None:
        """Note what a person should know."""
        self.warnings.append(text)

    def _name(self, topic: str) -> str:
        return f"{self._member}/{topic}" if topic == SET_STATE else topic


@dataclass
class TimedCommand:
    """Does every step after a while; see `blackboard.controller.Command`.

    Attributes:
        network: Gives the time.
        duration: Of a step [s].
        arrive: Called with the goal when a step succeeds.
        results: How the next steps end; those after them succeed.
        started: Every step that was started.
    """

    network: Network
    duration: Callable[[TaskStep], float]
    arrive: Callable[[Pose], None] = lambda _: None
    results: list[CommandResult] = field(default_factory=list)
    started: list[TaskStep] = field(default_factory=list)
    _call: _Call | None = None

    def start(self, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        """Begin a step."""
        self.started.append(step)
        ok = CommandResult(CommandState.SUCCEEDED)
        result = self.results.pop(0) if self.results else ok

        def end() -> None:
            if result == ok:
                self.arrive(step.goal)
            done(result)

        self._call = self.network.schedule(self.duration(step), end)

    def cancel(self) -> None:
        """Stop."""
        if self._call is not None:
            self._call.cancel()


class Hive:
    """A blackboard and some robots on one network.

    Attributes:
        network: What they talk over, and the time.
        talkers: The members' talkers by name.
        robots: By name.
        commands: What makes each robot do its steps, by name.
    """

    def __init__(self, settings: BlackboardSettings | None = None) -> None:
        self.network = Network()
        self.robots: dict[str, Robot] = {}
        self.commands: dict[str, TimedCommand] = {}
        self.talkers: dict[str, NetworkTalker] = {}
        talker = self._talker("blackboard")
        disk = MemoryJournal(founded("blackboard"))
        backup = Backup(talker, "blackboard", BackupSettings(), disk, random.Random(0))
        settings = settings or BlackboardSettings()
        Blackboard(talker, backup, StraightWays(), settings).start()
        backup.start()

    def add_robot(
        self,
        name: str,
        pose: Pose,
        characteristics: RobotCharacteristics = SMALL_ROBOT,
        *,
        ways: Ways | None = None,
        charge: float = 1.0,
        cost_model: str = "report",
    ) -> Robot:
        """Let a robot join; it does what it is told at once and without fault."""
        talker = self._talker(name)
        battery = Battery(characteristics.battery, charge)
        command = TimedCommand(self.network, lambda _: 10.0)
        controller = Controller(dict.fromkeys(StepKind, command), talker, ControllerSettings())
        settings = RobotSettings(cost_model=cost_model)
        robot = Robot(
            talker,
            name,
            characteristics,
            battery,
            ways or StraightWays(),
            controller,
            pose,
            settings,
            MemoryJournal(),
        )
        command.arrive = robot.set_pose
        self.robots[name] = robot
        self.commands[name] = command
        robot.start()
        self.network.run(10 * LATENCY)
        return robot

    def post(self, *tasks: Task) -> None:
        """Post tasks as an operator does."""
        for task in tasks:
            self.network.send(NEW_TASK, task)

    def cancel(self, task_id: str) -> None:
        """Cancel a task as an operator does."""
        self.network.send(TASK_CANCEL, task_id)

    def set_state(self, robot: str, word: str) -> None:
        """Set a robot's state as an operator does."""
        self.network.send(f"{robot}/{SET_STATE}", word)

    def updates(self, task_id: str) -> list[TaskUpdate]:
        """Return all that was said about a task, in the order it was heard."""
        said: list[Any] = [message for topic, message in self.network.heard if topic == TASK_STATE]
        return [update for update in said if update.task_id == task_id]

    def states(self, task_id: str) -> list[TaskState]:
        """Return the states that a task went through, repetitions left out."""
        said = [update.state for update in self.updates(task_id)]
        return [state for state, _ in itertools.groupby(said)]

    def record(self, task_id: str) -> TaskRecord:
        """Return a task as the last copy of the task list has it."""
        lists: list[Any] = [message for topic, message in self.network.heard if topic == SYNC]
        latest: TaskList = lists[-1]
        return next(record for record in latest.records if record.task.id == task_id)

    def all_ended(self, *task_ids: str) -> bool:
        """Return whether all of some tasks have reached a terminal state."""
        return all(
            any(update.state.is_terminal for update in self.updates(task_id))
            for task_id in task_ids
        )

    def _talker(self, member: str) -> NetworkTalker:
        talker = self.talkers[member] = NetworkTalker(self.network, member)
        return talker
