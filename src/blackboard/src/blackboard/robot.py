# SPDX-License-Identifier: BSD-3-Clause
"""One robot of the hive: it bids, keeps its list of tasks and works through it (report: Robot).

A robot obeys the blackboard's orders and compares its own list with every copy of the task list it
hears, so that an order that was lost on the way is made good by the next copy. What it has to
report, it repeats until a copy of the list shows that the blackboard knows.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from blackboard.bidding import Bidder
from blackboard.characteristics import RobotCharacteristics, RobotState, RobotStatus
from blackboard.controller import CommandState
from blackboard.cost import COST_MODELS, Bids, friction_force
from blackboard.itinerary import Itinerary
from blackboard.record import TaskUpdate
from blackboard.reports import Reports
from blackboard.talker import (
    ROBOT_STATUS,
    SET_STATE,
    SYNC,
    TASK_ASSIGN,
    TASK_BROADCAST,
    TASK_COST,
    TASK_STATE,
)
from blackboard.task import StepKind, TaskState, TaskType, load_during, split_task

if TYPE_CHECKING:
    from blackboard.backup import TaskList
    from blackboard.battery import Battery
    from blackboard.controller import CommandResult, Controller
    from blackboard.itinerary import Entry
    from blackboard.pose import Pose
    from blackboard.record import Broadcast, Order
    from blackboard.settings import RobotSettings
    from blackboard.talker import Talker
    from blackboard.ways import Ways

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
    ) -> None:
        self._talker = talker
        self._id = robot_id
        self._characteristics = characteristics
        self._battery = battery
        self._controller = controller
        self._pose = pose
        self._settings = settings
        self._list = Itinerary(characteristics, ways)
        model = COST_MODELS[settings.cost_model]
        self._bidder = Bidder(robot_id, characteristics, battery, self._list, model)
        self._reports = Reports(talker, robot_id)
        self._at_work = False
        self._out_of_service: RobotState | None = None
        self._reason = ""
        self._left_on_board = 0.0

    def start(self) -> None:
        """Begin to listen and to say how it is."""
        self._talker.subscribe(TASK_BROADCAST, self._bid)
        self._talker.subscribe(TASK_ASSIGN, self._obey)
        self._talker.subscribe(SYNC, self._compare)
        self._talker.subscribe(SET_STATE, self.set_state)
        self._talker.every(self._settings.status_period, self._pass_time)
        self._say_status()

    @property
    def status(self) -> RobotStatus:
        """How it is now."""
        current = self._current()
        return RobotStatus(
            robot_id=self._id,
            state=self.state,
            pose=self._pose,
            charge=self._battery.level,
            payload=self._payload(),
            task_id=current.task.id if current else "",
            reason=self._reason,
            tasks=tuple(entry.task.id for entry in self._list),
        )

    @property
    def state(self) -> RobotState:
        """Whether it can be counted on."""
        if self._out_of_service is not None:
            return self._out_of_service
        return RobotState.BUSY if self._at_work else RobotState.IDLE

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
        for task, step in broadcast.tasks:
            if self._out_of_service is not None:
                bids.append(self._bidder.refuse(task, self._reason))
            else:
                bids.append(self._bidder.bid(task, step, self._pose, at_work=self._at_work))
        answer = Bids(self._id, broadcast.epoch, broadcast.auction, tuple(bids))
        self._talker.publish(TASK_COST, answer)

    def _obey(self, order: Order) -> None:
        if order.robot_id != self._id:
            return
        entry = self._list.get(order.task.id)
        if order.take_back:
            if entry is not None and entry.order.assignment <= order.assignment:
                self._drop(entry)
        elif entry is None and not self._reports.answer(order):
            self._list.insert(order, self._pose, keep_first=self._at_work)
            self._go_on()
            self._say_status()

    def _compare(self, known: TaskList) -> None:
        """Drop what is no longer its own, and stop repeating what the blackboard knows."""
        self._reports.acknowledge(known)
        for record in known.records:
            entry = self._list.get(record.task.id)
            if entry is not None and record.has_ended(self._id, entry.order.assignment):
                self._drop(entry)

    def _pass_time(self) -> None:
        period = self._settings.status_period
        self._battery.update_level(self._characteristics.idle_power * period)
        if self._out_of_service is RobotState.CHARGING:
            self._battery.charge(period)
            if self._battery.level >= 1.0:
                # Only a person can say that a load which was left on board is gone.
                self.set_state("defect" if self._left_on_board else "idle")
        self._reports.repeat()
        self._say_status()

    def _go_on(self) -> None:
        """Start the next task; a robot that is out of service hands them all back instead."""
        entry = self._list.first()
        if self._out_of_service is not None:
            reason = f"{self._id} is out of service: {self._reason}"
            for held in tuple(self._list):
                self._hand_back(held, reason)
        elif entry is not None and not self._at_work:
            self._at_work = True
            self._say_started(entry)
            self._controller.run(entry.task, entry.step, self._step_done, self._task_ended)

    def _step_done(self, step: int) -> None:
        entry = self._current()
        assert entry is not None  # noqa: S101  (the controller runs only what is on the list)
        kind = split_task(entry.task)[step - 1].kind
        if kind is not StepKind.MOVE:
            robot = self._characteristics
            picks = kind is StepKind.PICK
            arm_time = robot.pick_duration if picks else robot.place_duration
            self._battery.update_level(robot.arm_power * arm_time)
        self._list.advance(entry.task.id, step)
        entry = self._current()
        if entry is not None and step < len(split_task(entry.task)):
            self._say_started(entry)

    def _task_ended(self, result: CommandResult) -> None:
        entry = self._current()
        assert entry is not None  # noqa: S101  (the controller runs only what is on the list)
        if result.state is CommandState.SUCCEEDED:
            self._at_work = False
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

    def _hand_back(self, entry: Entry, reason: str) -> None:
        """Give a task back to the blackboard; one whose load is on board needs a person."""
        loaded = self._strand(entry)
        self._list.remove(entry.task.id)
        if loaded:
            text = f"{reason}; its load of {loaded:g} kg is on board at {self._pose}: take it off"
            self._reports.add(self._update(entry, TaskState.FAILED, reason=text))
        else:
            self._reports.add(self._update(entry, TaskState.WAITING, reason=reason))

    def _strand(self, entry: Entry) -> float:
        """Stop a task if it is under way; return what its arm has taken on board [kg].

        A robot with a load that belongs nowhere any more leaves service until a person has seen
        to it.
        """
        if entry is not self._current():
            return 0.0
        self._controller.stop()
        self._at_work = False
        picks = TaskType(entry.task.type).picks
        loaded = load_during(entry.task, entry.step) if picks else 0.0
        if loaded:
            self._left_on_board = loaded
            self._out_of_service = self._out_of_service or RobotState.DEFECT
            self._reason = (
                f"the load of {entry.task.id} ({loaded:g} kg) is on board: "
                "take it off, then set the robot idle"
            )
        return loaded

    def _current(self) -> Entry | None:
        return self._list.first() if self._at_work else None

    def _payload(self) -> float:
        entry = self._current()
        return load_during(entry.task, entry.step) if entry else self._left_on_board

    def _say_started(self, entry: Entry) -> None:
        eta = self._list.ahead(self._pose)[0].duration
        update = self._update(entry, TaskState.STARTED, eta=eta if math.isfinite(eta) else 0.0)
        self._talker.publish(TASK_STATE, update)

    def _update(
        self, entry: Entry, state: TaskState, eta: float = 0.0, reason: str = ""
    ) -> TaskUpdate:
        return TaskUpdate(
            task_id=entry.task.id,
            state=state,
            robot_id=self._id,
            step=entry.step,
            steps=len(split_task(entry.task)),
            eta=eta,
            epoch=entry.order.epoch,
            reason=reason,
            assignment=entry.order.assignment,
        )

    def _say_status(self) -> None:
        self._talker.publish(ROBOT_STATUS, self.status)
