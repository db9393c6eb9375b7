# SPDX-License-Identifier: BSD-3-Clause
"""One robot of the hive: it bids, keeps its list of tasks and works through it (report: Robot).

A robot obeys the blackboard's orders and compares its own list with what the member beside it
knows to be committed, which makes good an order that was lost. It repeats reports until they show.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.consensus.hive_filter import NoFilter
from blackboard.costing.aging import Aging
from blackboard.costing.cost import friction_force
from blackboard.costing.pace import DriveWatch, Pace
from blackboard.costing.preemption import may_put_off
from blackboard.costing.schedule import Entry, Schedule
from blackboard.domain.characteristics import RobotCharacteristics, RobotState, RobotStatus
from blackboard.domain.record import OrderKind
from blackboard.domain.talker import (
    ROBOT_STATUS,
    SET_STATE,
    TASK_ASSIGN,
    TASK_BROADCAST,
    TASK_COST,
    TASK_STATE,
)
from blackboard.domain.task import TaskState, is_picked, load_during, split_task
from blackboard.robot.answering import Answering
from blackboard.robot.charging import Charging, ChargingPlan
from blackboard.robot.controller import CommandState
from blackboard.robot.handback import Handback
from blackboard.robot.lease_keeper import LeaseKeeper
from blackboard.robot.reports import Reports
from blackboard.robot.respondent import Respondent
from blackboard.robot.service import WORDS, Service
from blackboard.robot.worker import Worker

if TYPE_CHECKING:
    from blackboard.consensus.hive_filter import HiveFilter
    from blackboard.consensus.journal import Journal
    from blackboard.consensus.task_list import TaskList
    from blackboard.domain.battery import Battery
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.record import Broadcast, Order
    from blackboard.domain.settings import RobotSettings
    from blackboard.domain.talker import Talker
    from blackboard.domain.task import Task
    from blackboard.robot.controller import CommandResult, Controller
    from hive_common.pose import Pose

__all__ = ["Robot", "RobotCharacteristics", "RobotState", "RobotStatus"]


class Robot:
    """Bids on what is broadcast and works through what it is given.

    Args:
        talker: How it hears and speaks.
        robot_id: Its name.
        characteristics: What it is.
        battery: Its battery.
        ways: Knows how far it is.
        controller: Executes its tasks.
        pose: Where it stands.
        settings: How it bids and speaks.
        journal: Its disk, for the reports that nobody has acknowledged yet.
        fence: The member beside it; where it is left out it obeys all, and reads `bb_sync`.
        plan: Where and when it charges; only where a person sets it to, where left out.

    Attributes:
        charging: Its battery between work and charger.
    """

    def __init__(
        self,
        talker: Talker,
        robot_id: str,
        characteristics: RobotCharacteristics,
        battery: Battery,
        path_lengths: PathLengths,
        controller: Controller,
        pose: Pose,
        settings: RobotSettings,
        journal: Journal,
        fence: HiveFilter | None = None,
        plan: ChargingPlan | None = None,
    ) -> None:
        self._talker = talker
        self._id = robot_id
        self._characteristics = characteristics
        self._battery = battery
        self._pose = pose
        self._settings = settings
        aging = Aging(talker.now, settings.aging)
        pace = Pace(characteristics.max_speed)
        controller.look_at(lambda: self._pose)
        controller.watch(DriveWatch(pace, path_lengths, talker.now, lambda: self._pose))
        self._list = Schedule(characteristics, path_lengths, settings.cost_model, aging, pace)
        self._service = Service()
        self._fence = fence or NoFilter(talker)
        self._reports = Reports(talker, robot_id, journal, self._fence)
        period, say = settings.status_period, self._say_status
        self._lease_keeper = LeaseKeeper(talker, robot_id, period, self._go_on, say, self._fence)
        self.charging = Charging(
            talker,
            robot_id,
            characteristics,
            battery,
            path_lengths,
            controller,
            self._service,
            plan,
        )
        self._work = Worker(
            controller,
            self._list,
            self._may_go,
            self._say_started,
            self._step_done,
            self._task_ended,
        )
        self._handback = Handback(self._work, self._list, self._service, self._reports)
        self._respondent = Respondent(
            robot_id, characteristics, battery, self._list, self.charging, settings
        )
        self._answering = Answering(robot_id, self._answer)

    def start(self) -> None:
        """Begin to listen and to say how it is."""
        self._talker.subscribe(TASK_BROADCAST, self._answering.hear)
        self._talker.subscribe(TASK_ASSIGN, self._obey)
        self._fence.follow(self._compare)
        self._lease_keeper.start()
        self.charging.start(self._pose, self._lease_keeper.holds, self._go_on)
        self._talker.subscribe(SET_STATE, self.set_state)
        self._talker.every(self._settings.status_period, self._pass_time)
        self._say_status()

    @property
    def status(self) -> RobotStatus:
        """How it is now."""
        current = self._work.current
        return RobotStatus(
            robot_id=self._id,
            state=self.state,
            pose=self._pose,
            charge=self._battery.level,
            payload=self._payload(),
            task_id=current.task.id if current else "",
            reason=self._service.reason or self._lease_keeper.reason(self._work),
            tasks=tuple(entry.task.id for entry in self._list),
            sent=self._talker.now(),
            hive=self._lease_keeper.hive,
        )

    @property
    def state(self) -> RobotState:
        """Whether it can be counted on."""
        in_service = RobotState.IDLE if self._work.current is None else RobotState.BUSY
        return in_service if self._service.state is None else self._service.state

    def set_pose(self, pose: Pose) -> None:
        """Note where it stands [map frame]."""
        self._pose = pose
        self.charging.note_pose(pose)

    def add_travel(self, distance: float) -> None:
        """Draw from the battery what driving a distance [m] takes with the load on board."""
        mass = self._characteristics.mass + self._payload()
        force = friction_force(self._characteristics.friction_coefficient, mass)
        self._battery.update_level(force * distance)

    def set_state(self, word: str) -> None:
        """Obey an operator who says `idle`, `defect` or `charging`; see `Service.set`."""
        if word not in WORDS:
            reason = f"{word[:40]!r} is unknown; allowed: {', '.join(WORDS)}"
            self._talker.refuse(SET_STATE, reason)
            return
        self.charging.abandon()
        self._service.set(word)
        self._go_on()
        self._say_status()

    def _answer(self, broadcast: Broadcast) -> None:
        if self._lease_keeper.obeys(broadcast.hive, broadcast.epoch):
            at_work = self._work.current is not None
            answer = self._respondent.answer(broadcast, self._pose, at_work=at_work)
            self._talker.publish(TASK_COST, answer, self._fence.leader)

    def _obey(self, order: Order) -> None:
        if order.robot_id != self._id or not self._lease_keeper.allows(order):
            return
        entry = self._list.get(order.task.id)
        if order.kind is not OrderKind.ASSIGN:
            self._let_go(order, entry)
            return
        if entry is not None:
            if order.assignment > entry.order.assignment:
                self._list.renew(order)
        elif not self._reports.answer(order):
            self._put_off_for(order.task)
            if is_picked(order.task, order.step):
                # In an earlier life of this process it was on its way with this load.
                self._work.stop()
            self._list.insert(order, self._pose, keep_first=self._work.current is not None)
            self._go_on()
            self._say_status()
        self._answering.note_order(order.task.id)

    def _let_go(self, order: Order, entry: Entry | None) -> None:
        """Drop a task that is to be taken back; say how far it has come where that is asked."""
        if entry is not None and not entry.yields_to(order, self._work.current):
            return
        if order.kind.asks_report:
            if entry is not None or not self._reports.answer(order):
                held = entry or Entry(order, order.step)
                self._hand_back(held, f"{self._id} was told to hand it back")
            self._go_on()
            self._say_status()
        elif entry is not None:
            self._drop(entry)
        if order.kind is OrderKind.FORGOTTEN:
            self._reports.forget(order)

    def _put_off_for(self, urgent: Task) -> None:
        """Hand back what is under way if a task that has just been given is to go before it."""
        current = self._work.current
        if current is not None and may_put_off(current, urgent):
            self._hand_back(current, f"{self._id} put it off for {urgent.id}", urgent.id)

    def _compare(self, known: TaskList) -> None:
        """Drop what is no longer its own, and stop repeating what the blackboard knows."""
        if not self._lease_keeper.obeys(known.hive, known.epoch):
            return
        self._reports.acknowledge(known)
        for record in self._reports.known_of([entry.task.id for entry in self._list]):
            entry = self._list.get(record.task.id)
            if entry is not None and record.has_ended(self._id, entry.order.assignment):
                self._drop(entry)
            else:
                self._list.note_known(record)
        self._go_on()

    def _may_go(self, entry: Entry) -> bool:
        """Return whether the next step of a task may be done now."""
        return self._lease_keeper.holds() and entry.is_announced

    def _pass_time(self) -> None:
        self.charging.pass_time(self._settings.status_period)
        self._go_on()
        self._reports.repeat()
        self._fence.show()
        current = self._work.current
        if current is not None and current.known < current.step < current.steps:
            self._say_started(current)
        self._say_status()

    def _go_on(self) -> None:
        """Go on with the list; a robot that is out of service hands them all back instead."""
        current = self._work.current
        loaded = current is not None and is_picked(current.task, current.step)
        self.charging.consider(idle=self._list.first() is None, loaded=loaded)
        if self._service.state is not None:
            reason = f"{self._id} is out of service: {self._service.reason}"
            for held in tuple(self._list):
                self._hand_back(held, reason)
        else:
            self._work.go_on()

    def _step_done(self, step: int) -> None:
        entry = self._work.current
        assert entry is not None  # noqa: S101  (the controller runs only what is on the list)
        arm_time = self._characteristics.arm_time(split_task(entry.task)[step - 1].kind)
        self._battery.update_level(self._characteristics.arm_power * arm_time)
        self._list.advance(entry.task.id, step)
        entry = self._work.current
        if entry is not None and step < entry.steps:
            self._say_started(entry)

    def _task_ended(self, result: CommandResult) -> None:
        entry = self._work.current
        assert entry is not None  # noqa: S101  (the controller runs only what is on the list)
        if result.state is CommandState.SUCCEEDED:
            self._work.stop()
            self._list.remove(entry.task.id)
            self._reports.add(entry.update(TaskState.DONE))
        else:
            self._hand_back(entry, f"{self._id}: {result.state.value}: {result.text}")
        self._go_on()
        self._say_status()

    def _drop(self, entry: Entry) -> None:
        """Take a task off the list that is no longer its own; stop it where it is under way."""
        self._handback.drop(entry)
        self._go_on()
        self._say_status()

    def _hand_back(self, entry: Entry, reason: str, put_off_for: str = "") -> None:
        self._handback.hand_back(entry, reason, self._pose, put_off_for)

    def _payload(self) -> float:
        entry = self._work.current
        return load_during(entry.task, entry.step) if entry else self._service.left_on_board or 0.0

    def _say_started(self, entry: Entry) -> None:
        started = entry.update(TaskState.STARTED, **self._list.promise(self._pose))
        self._talker.publish(TASK_STATE, started, self._fence.leader)

    def _say_status(self) -> None:
        self._talker.publish(ROBOT_STATUS, self.status, self._fence.carriers)
