# SPDX-License-Identifier: BSD-3-Clause
"""One robot of the hive: it bids, keeps its list of tasks and works through it (report: Robot).

A robot obeys the blackboard's orders and compares its own list with every copy of the task list it
hears, so that an order that was lost on the way is made good by the next copy. What it has to
report, it repeats until a copy of the list shows that the blackboard knows.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.bidding import Bidder
from blackboard.characteristics import RobotCharacteristics, RobotState, RobotStatus
from blackboard.controller import CommandState
from blackboard.cost import COST_MODELS, Bids, friction_force
from blackboard.itinerary import Entry, Itinerary
from blackboard.lease import Lease
from blackboard.preemption import may_put_off
from blackboard.record import TaskUpdate
from blackboard.reports import Reports
from blackboard.talker import (
    BACKUP,
    ROBOT_STATUS,
    SET_STATE,
    SYNC,
    TASK_ASSIGN,
    TASK_BROADCAST,
    TASK_COST,
    TASK_STATE,
)
from blackboard.task import StepKind, TaskState, is_picked, load_during, split_task
from blackboard.worker import Worker

if TYPE_CHECKING:
    from blackboard.backup import Heartbeat, TaskList
    from blackboard.battery import Battery
    from blackboard.controller import CommandResult, Controller
    from blackboard.journal import Journal
    from blackboard.pose import Pose
    from blackboard.record import Broadcast, Order
    from blackboard.settings import RobotSettings
    from blackboard.talker import Talker, Timer
    from blackboard.task import Task
    from blackboard.ways import Ways

__all__ = ["Robot", "RobotCharacteristics", "RobotState", "RobotStatus"]


_PERIODS_UNHEARD = 1.5
"""A status that was not echoed by then got lost, and is sent again at every heartbeat."""


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
    """

    def __init__(
        self,
        talker: Talker,
        robot_id: str,
        characteristics: RobotCharacteristics,
        battery: Battery,
        ways: Ways,
        controller: Controller,
        pose: Pose,
        settings: RobotSettings,
        journal: Journal,
    ) -> None:
        self._talker = talker
        self._id = robot_id
        self._characteristics = characteristics
        self._battery = battery
        self._pose = pose
        self._settings = settings
        self._list = Itinerary(characteristics, ways)
        model = COST_MODELS[settings.cost_model]
        self._bidder = Bidder(robot_id, characteristics, battery, self._list, model)
        self._reports = Reports(talker, robot_id, journal)
        self._steady = talker.steady
        self._lease = Lease(robot_id, self._steady.now())
        self._lapse: Timer | None = None
        self._work = Worker(
            controller,
            self._list,
            self._may_go,
            self._say_started,
            self._step_done,
            self._task_ended,
        )
        self._out_of_service: RobotState | None = None
        self._reason = ""
        self._left_on_board = 0.0

    def start(self) -> None:
        """Begin to listen and to say how it is."""
        self._talker.subscribe(TASK_BROADCAST, self._bid)
        self._talker.subscribe(TASK_ASSIGN, self._obey)
        self._talker.subscribe(SYNC, self._compare)
        self._talker.subscribe(BACKUP, self._hear_beat)
        self._talker.subscribe(SET_STATE, self.set_state)
        self._talker.every(self._settings.status_period, self._pass_time)
        self._steady.every(self._settings.status_period, self._say_status)
        self._say_status()

    @property
    def status(self) -> RobotStatus:
        """How it is now."""
        current = self._work.current
        reason = self._reason
        if not reason and self._work.stands_still and not self._lease.holds(self._steady.now()):
            reason = "stands still until an active blackboard says that it has heard it"
        return RobotStatus(
            robot_id=self._id,
            state=self.state,
            pose=self._pose,
            charge=self._battery.level,
            payload=self._payload(),
            task_id=current.task.id if current else "",
            reason=reason,
            tasks=tuple(entry.task.id for entry in self._list),
            sent=self._steady.now(),
        )

    @property
    def state(self) -> RobotState:
        """Whether it can be counted on."""
        if self._out_of_service is not None:
            return self._out_of_service
        return RobotState.IDLE if self._work.current is None else RobotState.BUSY

    def set_pose(self, pose: Pose) -> None:
        """Note where it stands [map frame]."""
        self._pose = pose

    def add_travel(self, distance: float) -> None:
        """Draw from the battery what driving a distance [m] takes with the load on board."""
        mass = self._characteristics.mass + self._payload()
        force = friction_force(self._characteristics.friction_coefficient, mass)
        self._battery.update_level(force * distance)

    def set_state(self, word: str) -> None:
        """Obey an operator: `defect`, `charging`, or `idle` to put it back in service.

        Putting it back in service also says that nothing is on board any more.
        """
        if word == "idle":
            self._out_of_service, self._reason, self._left_on_board = None, "", 0.0
        elif word in {"defect", "charging"}:
            self._out_of_service = RobotState[word.upper()]
            if not self._left_on_board:
                self._reason = f"{word}, set by an operator"
        else:
            self._talker.warn(
                f"set_state {word[:40]!r} is unknown; allowed: idle, defect, charging"
            )
            return
        self._go_on()
        self._say_status()

    def _bid(self, broadcast: Broadcast) -> None:
        bids = []
        at_work = self._work.current is not None
        for task, step in broadcast.tasks:
            if self._out_of_service is not None:
                bids.append(self._bidder.refuse(task, self._reason))
            else:
                bids.append(self._bidder.bid(task, step, self._pose, at_work=at_work))
        answer = Bids(self._id, broadcast.epoch, broadcast.auction, tuple(bids))
        self._talker.publish(TASK_COST, answer)

    def _obey(self, order: Order) -> None:
        if order.robot_id != self._id:
            return
        entry = self._list.get(order.task.id)
        if order.take_back:
            self._let_go(order, entry)
        elif not self._lease.covers(order.heard, self._steady.now()):
            return
        elif entry is not None:
            if order.assignment > entry.order.assignment:
                self._list.renew(order)
        elif not self._reports.answer(order):
            self._put_off_for(order.task)
            keep_first = self._work.current is not None
            self._list.insert(order, self._pose, keep_first=keep_first)
            self._go_on()
            self._say_status()

    def _let_go(self, order: Order, entry: Entry | None) -> None:
        """Drop a task that is to be taken back; say how far it has come where that is asked."""
        if entry is not None and entry.order.assignment > order.assignment:
            return
        if order.hand_back:
            held = entry or Entry(order, order.step)
            if entry is not None or not self._reports.answer(order):
                self._hand_back(held, f"{self._id} was told to hand it back")
            self._go_on()
            self._say_status()
        elif entry is not None:
            self._drop(entry)

    def _put_off_for(self, urgent: Task) -> None:
        """Hand back what is under way if a task that has just been given is to go before it."""
        current = self._work.current
        if current is not None and may_put_off(current, urgent):
            self._hand_back(current, f"{self._id} put it off for {urgent.id}", urgent.id)

    def _compare(self, known: TaskList) -> None:
        """Drop what is no longer its own, and stop repeating what the blackboard knows."""
        self._reports.acknowledge(known)
        for record in known.records:
            entry = self._list.get(record.task.id)
            if entry is None:
                continue
            if record.has_ended(self._id, entry.order.assignment):
                self._drop(entry)
            elif (record.state, record.assignment) == (TaskState.STARTED, entry.order.assignment):
                self._list.note_known(record.task.id, record.step)
        self._go_on()

    def _hear_beat(self, beat: Heartbeat) -> None:
        """Go on working while an active blackboard hears this robot, and halt in time if not."""
        now = self._steady.now()
        if not self._lease.renew(beat, now):
            patience = _PERIODS_UNHEARD * self._settings.status_period
            if not self._lease.is_echoed_within(patience, now):
                self._say_status()
            return
        if self._lapse is not None:
            self._lapse.cancel()
        self._lapse = self._steady.after(self._lease.remaining(now), self._go_on)
        self._go_on()

    def _may_go(self, entry: Entry) -> bool:
        """Return whether the next step of a task may be done now.

        Before a load is taken on board, the task list has to show that it is going to be: it says
        where to look for the load if this robot is lost.
        """
        kind = split_task(entry.task)[entry.step].kind if entry.step < _steps(entry) else None
        listed = max(entry.known, entry.order.step) >= entry.step
        return self._lease.holds(self._steady.now()) and (kind is not StepKind.PICK or listed)

    def _pass_time(self) -> None:
        period = self._settings.status_period
        self._battery.update_level(self._characteristics.idle_power * period)
        if self._out_of_service is RobotState.CHARGING:
            self._battery.charge(period)
            if self._battery.level >= 1.0:
                # Only a person can say that a load which was left on board is gone.
                self.set_state("defect" if self._left_on_board else "idle")
        self._reports.repeat()
        current = self._work.current
        if current is not None and current.known < current.step < _steps(current):
            self._say_started(current)

    def _go_on(self) -> None:
        """Go on with the list; a robot that is out of service hands them all back instead."""
        if self._out_of_service is not None:
            reason = f"{self._id} is out of service: {self._reason}"
            for held in tuple(self._list):
                self._hand_back(held, reason)
        else:
            self._work.go_on()

    def _step_done(self, step: int) -> None:
        entry = self._work.current
        assert entry is not None  # noqa: S101  (the controller runs only what is on the list)
        kind = split_task(entry.task)[step - 1].kind
        if kind is not StepKind.MOVE:
            robot = self._characteristics
            picks = kind is StepKind.PICK
            arm_time = robot.pick_duration if picks else robot.place_duration
            self._battery.update_level(robot.arm_power * arm_time)
        self._list.advance(entry.task.id, step)
        entry = self._work.current
        if entry is not None and step < _steps(entry):
            self._say_started(entry)

    def _task_ended(self, result: CommandResult) -> None:
        entry = self._work.current
        assert entry is not None  # noqa: S101  (the controller runs only what is on the list)
        if result.state is CommandState.SUCCEEDED:
            self._work.stop()
            self._list.remove(entry.task.id)
            self._reports.add(self._update(entry, TaskState.DONE))
        else:
            self._hand_back(entry, f"{self._id}: {result.state.value}: {result.text}")
        self._go_on()
        self._say_status()

    def _drop(self, entry: Entry) -> None:
        """Take a task off the list that is no longer its own; stop it where it is under way."""
        self._strand(entry)
        self._list.remove(entry.task.id)
        self._go_on()
        self._say_status()

    def _hand_back(self, entry: Entry, reason: str, put_off_for: str = "") -> None:
        """Give a task back to the blackboard; one whose load is on board needs a person."""
        loaded = self._strand(entry)
        self._list.remove(entry.task.id)
        if loaded:
            weight = f"{entry.task.payload:g} kg"
            reason += f"; its load of {weight} is on board at {self._pose}: take it off"
        state = TaskState.FAILED if loaded else TaskState.WAITING
        update = self._update(entry, state, reason=reason)
        self._reports.add(replace(update, put_off_for=put_off_for))

    def _strand(self, entry: Entry) -> bool:
        """Stop a task if it is under way; return whether its arm has taken its load on board.

        A robot with a load that belongs nowhere any more leaves service until a person has seen
        to it.
        """
        if entry is not self._work.current:
            return False
        self._work.stop()
        loaded = is_picked(entry.task, entry.step)
        if loaded:
            self._left_on_board = entry.task.payload
            self._out_of_service = self._out_of_service or RobotState.DEFECT
            self._reason = (
                f"the load of {entry.task.id} ({entry.task.payload:g} kg) is on board: "
                "take it off, then set the robot idle"
            )
        return loaded

    def _payload(self) -> float:
        entry = self._work.current
        return load_during(entry.task, entry.step) if entry else self._left_on_board

    def _say_started(self, entry: Entry) -> None:
        eta = self._list.ahead(self._pose)[0].duration
        step_eta = self._list.next_step(self._pose).duration
        update = self._update(entry, TaskState.STARTED)
        if math.isfinite(eta):
            update = replace(update, eta=eta, step_eta=step_eta)
        self._talker.publish(TASK_STATE, update)

    def _update(self, entry: Entry, state: TaskState, reason: str = "") -> TaskUpdate:
        return TaskUpdate(
            task_id=entry.task.id,
            state=state,
            robot_id=self._id,
            step=entry.step,
            steps=_steps(entry),
            epoch=entry.order.epoch,
            reason=reason,
            assignment=entry.order.assignment,
        )

    def _say_status(self) -> None:
        self._talker.publish(ROBOT_STATUS, self.status)


def _steps(entry: Entry) -> int:
    return len(split_task(entry.task))
