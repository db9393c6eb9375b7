# SPDX-License-Identifier: BSD-3-Clause
"""A robot without a hive: it does what it is ordered, and reports to whoever has ordered it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from blackboard.consensus.journal import MemoryJournal
from blackboard.costing.bid_basis import BidBasis
from blackboard.costing.insertion import Aging
from blackboard.costing.schedule import Schedule
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import OrderKind, TaskUpdate
from blackboard.domain.settings import ControllerSettings, RobotSettings
from blackboard.domain.talker import ROBOT_STATUS, TASK_ASSIGN, TASK_STATE
from blackboard.domain.task import StepKind, TaskState, load_during
from blackboard.robot.executor import CommandState, Controller
from blackboard.robot.learning import Learning

if TYPE_CHECKING:
    from collections.abc import Collection

    from blackboard.costing.schedule import Entry
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.record import Order
    from blackboard.domain.talker import Talker
    from blackboard.robot.executor import CommandResult
    from hive_common.pose import Pose
    from hive_lab.architectures.trial import TrialRobot

_SETTINGS = RobotSettings()


class Worker(ABC):
    """Does one task after the other; a subclass says who hears its status.

    It learns what steps take as the hive's robots do. It has nothing of what those have for a
    leader that changes: no lease, no journal, no task list.

    Args:
        robot: What it drives.
        talker: Its own.
        path_lengths: For its radius.
        cost_model: How it works out what a task costs it.
    """

    def __init__(
        self, robot: TrialRobot, talker: Talker, path_lengths: PathLengths, cost_model: str
    ) -> None:
        body, moves = robot.characteristics, robot.body
        self.name = robot.name
        self.talker = talker
        self.body = body
        self.cost_model = cost_model
        self.battery = moves.battery.measured
        self.pose = moves.pose
        moves.moved = self._note_pose
        self._ended: dict[str, tuple[TaskUpdate, str]] = {}  # reports, and to whom
        self._unheard: set[str] = set()  # of which tasks nobody has acknowledged the report
        self._learning = Learning(
            talker, self.name, body, self.battery, path_lengths, MemoryJournal()
        )
        self.schedule = Schedule(
            body,
            path_lengths,
            cost_model,
            Aging(talker.date, _SETTINGS.aging),
            self._learning.experience,
        )
        commands = dict.fromkeys(StepKind, moves)
        self._controller = Controller(commands, talker.world, ControllerSettings())
        self._controller.observe(
            lambda: self.pose,
            lambda step: self._learning.time_step(step, self.pose, self._payload()),
        )

    def start(self) -> None:
        """Begin to listen, and to tell how it is."""
        self.talker.subscribe(TASK_ASSIGN, self._obey)
        self.talker.every(_SETTINGS.status_period, self._repeat)
        self._tell_status()

    @property
    @abstractmethod
    def listeners(self) -> Collection[str]:
        """The names of the nodes that hear its status."""

    @property
    def at_work(self) -> bool:
        """Whether its first task is under way."""
        return bool(self._controller.task_id)

    @property
    def basis(self) -> BidBasis:
        """What its bids are made from."""
        return BidBasis(
            self.body,
            self.cost_model,
            _SETTINGS.aging,
            self.pose,
            self.battery.level,
            self.at_work,
            tasks=tuple((entry.task.id, entry.step) for entry in self.schedule),
            pace=self._learning.experience.learned,
        )

    def task_ended(self) -> None:  # noqa: B027  (a subclass need not do anything)
        """Do what a subclass does when a task has ended."""

    def _note_pose(self, pose: Pose) -> None:
        self.pose = pose

    def _obey(self, order: Order) -> None:
        if order.robot_id != self.name:
            return
        entry = self.schedule.get(order.task.id)
        report, _ = self._ended.get(order.task.id, (None, ""))
        if order.kind is OrderKind.FORGOTTEN:
            if report is not None and report.assignment <= order.assignment:
                self._unheard.discard(order.task.id)
        elif order.kind is OrderKind.TAKE_BACK:
            if entry is not None and entry.order.assignment <= order.assignment:
                self._drop(entry)
        elif report is not None and report.assignment >= order.assignment:
            self._send(order.task.id)  # an order that came late
        elif entry is not None:
            self.schedule.renew(order)
        else:
            self.schedule.insert(order, self.pose, keep_first=self.at_work)
        self._go_on()
        self._tell_status()

    def _drop(self, entry: Entry) -> None:
        if entry.task.id == self._controller.task_id:
            self._controller.stop()
        self.schedule.remove(entry.task.id)

    def _go_on(self) -> None:
        entry = self.schedule.first()
        if entry is not None and not self.at_work:
            self._report(entry, TaskState.STARTED)
            self._learning.begin_task(entry.task, entry.step, self.pose)
            self._controller.run(entry.task, entry.step, self._step_done, self._task_ended)

    def _step_done(self, step: int) -> None:
        task_id = self._controller.task_id
        self.schedule.advance(task_id, step)
        entry = self.schedule.get(task_id)
        if entry is not None and step < entry.steps:
            self._report(entry, TaskState.STARTED)

    def _task_ended(self, result: CommandResult) -> None:
        entry = self.schedule.first()
        assert entry is not None  # noqa: S101  (the controller runs only what is on the schedule)
        self.schedule.remove(entry.task.id)
        works = result.state is CommandState.SUCCEEDED
        if works:
            self._learning.end_task(entry.task.id)
        update = entry.update(TaskState.DONE if works else TaskState.WAITING)
        self._ended[entry.task.id] = update, entry.order.hive
        self._unheard.add(entry.task.id)
        self._send(entry.task.id)
        self.task_ended()
        self._go_on()
        self._tell_status()

    def _payload(self) -> float:
        """Return what is on board [kg]."""
        entry = self.schedule.first() if self.at_work else None
        return load_during(entry.task, entry.step) if entry is not None else 0.0

    def _report(self, entry: Entry, state: TaskState) -> None:
        self.talker.publish(TASK_STATE, entry.update(state), (entry.order.hive,))

    def _send(self, task_id: str) -> None:
        update, to = self._ended[task_id]
        self.talker.publish(TASK_STATE, update, (to,))

    def _repeat(self) -> None:
        for task_id in sorted(self._unheard):
            self._send(task_id)
        entry = self.schedule.first() if self.at_work else None
        if entry is not None:
            self._report(entry, TaskState.STARTED)
        self._tell_status()

    def _tell_status(self) -> None:
        listeners = self.listeners
        if not listeners:
            return
        entry = self.schedule.first() if self.at_work else None
        status = RobotStatus(
            self.name,
            RobotState.IDLE if entry is None else RobotState.BUSY,
            self.pose,
            self.battery.level,
            self._payload(),
            entry.task.id if entry is not None else "",
            tasks=tuple(each.task.id for each in self.schedule),
            sent=self.talker.now(),
            carries=self.body.carries,
        )
        self.talker.publish(ROBOT_STATUS, status, listeners)
