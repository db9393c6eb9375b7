# SPDX-License-Identifier: BSD-3-Clause
"""One robot of the hive: it bids, keeps a schedule and works through it (the report's Robot).

A robot obeys the leader's orders. It also compares its schedule with the task list that the member
beside it knows to be committed, which makes up for lost orders, and repeats its reports until that
list shows them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.consensus.hive_filter import NoFilter
from blackboard.costing.cost import friction_force
from blackboard.costing.insertion import Aging
from blackboard.costing.preemption import may_put_off
from blackboard.costing.schedule import Entry, Schedule
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TOLD_TO, OrderKind
from blackboard.domain.talker import (
    ROBOT_STATUS,
    SET_STATE,
    TASK_ASSIGN,
    TASK_BROADCAST,
    TASK_COST,
    TASK_STATE,
)
from blackboard.domain.task import StepKind, TaskState, is_picked, load_during, split_task
from blackboard.robot.charging import Charging
from blackboard.robot.contact import Contact, Gate
from blackboard.robot.executor import CommandState, State
from blackboard.robot.learning import Learning
from blackboard.robot.lease_keeper import LeaseKeeper
from blackboard.robot.loads import Loads
from blackboard.robot.maps_in_use import MapsInUse
from blackboard.robot.reports import Reports
from blackboard.robot.respondent import Respondent
from blackboard.robot.service import FORGET, PUT_DOWN, WORDS, Service
from blackboard.robot.unloading import Unloading
from hive_common.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.consensus.hive_filter import HiveFilter
    from blackboard.consensus.journal import Journal
    from blackboard.consensus.task_list import TaskList
    from blackboard.domain.battery import Battery
    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.record import Broadcast, Order
    from blackboard.domain.settings import RobotSettings
    from blackboard.domain.talker import Talker
    from blackboard.domain.task import Task, TaskStep
    from blackboard.robot.charging import ChargingPlan
    from blackboard.robot.executor import CommandResult, Controller


class Robot:
    """Bids on what is broadcast and works through what it is given.

    Args:
        pose: Where it is [map frame].
        journal: Keeps the reports that nobody has acknowledged yet.
        hive_filter: The member beside it; without one it obeys every blackboard and reads
            `bb_sync`.
        plan: Where and when it charges; by default only where a person sets it to.

    Attributes:
        charging: Decides when it charges.
        trouble: What is wrong with it though it works, such as its clock; empty if nothing is.
        maps: Which maps its parts use; where one is not the leader's, it bids on nothing.
        learning: What its steps and tasks take.
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
        hive_filter: HiveFilter | None = None,
        plan: ChargingPlan | None = None,
    ) -> None:
        self._talker = talker = Gate(talker)
        self._contact = Contact.KEPT
        self._id = robot_id
        self._characteristics = characteristics
        self._battery = battery
        self._controller = controller
        self._pose = pose
        self._settings = settings
        self.trouble = ""
        self.maps = MapsInUse()
        self._unanswered: Broadcast | None = None
        self._last_order = ""
        aging = Aging(talker.date, settings.aging)
        self.learning = Learning(talker, robot_id, characteristics, battery, path_lengths, journal)
        controller.observe(
            lambda: self._pose,
            lambda step: self.learning.time_step(step, self._pose, self._payload()),
        )
        self._schedule = Schedule(
            characteristics, path_lengths, settings.cost_model, aging, self.learning.experience
        )
        self._service = service = Service()
        self._filter = hive_filter = hive_filter or NoFilter(talker)
        self._reports = Reports(talker, robot_id, journal, hive_filter)
        self._loads = Loads(talker, journal)
        controller.handle_loads(
            self._before_step, lambda task, looked: self._loads.miss(task, looked=looked)
        )
        self._lease = LeaseKeeper(
            talker,
            robot_id,
            settings.status_period,
            self._go_on,
            self._publish_status,
            hive_filter,
        )
        self.charging = Charging(
            talker,
            robot_id,
            characteristics,
            battery,
            path_lengths,
            controller,
            service,
            plan,
            self.learning.experience,
            journal,
        )
        self._unloading = Unloading(service, self._loads, controller)
        self._respondent = Respondent(
            robot_id, characteristics, battery, self._schedule, self.charging, settings
        )

    def start(self) -> None:
        """Begin to listen and to publish the status."""
        self._talker.subscribe(TASK_BROADCAST, self._hear_broadcast)
        self._talker.subscribe(TASK_ASSIGN, self._obey)
        self._filter.follow(self._compare)
        self._lease.start()
        self.charging.start(self._pose, self._lease, self._go_on, self._publish_status)
        self._talker.subscribe(SET_STATE, self.set_state)
        period = self._settings.status_period
        self._talker.world.every(period, lambda: self._pass_time(period))
        self._talker.every(period, self._repeat)
        self._publish_status()

    @property
    def status(self) -> RobotStatus:
        """How it is now."""
        current = self._current
        return RobotStatus(
            robot_id=self._id,
            state=self.state,
            pose=self._pose,
            charge=self._battery.level,
            payload=self._payload(),
            task_id=current.task.id if current else "",
            reason=self._reason,
            tasks=tuple(entry.task.id for entry in self._schedule),
            sent=self._talker.now(),
            hive=self._filter.hive,
            carries=self._characteristics.carries,
            map=self.maps.told(self._filter.leaders_map),
            charger=self.charging.charger,
            at_charger=self.charging.is_at_charger,
            charger_since=self.charging.since,
        )

    @property
    def _reason(self) -> str:
        """What there is to say about it; empty if all is well."""
        stopped = self._service.reason or self._why_stopped() or self._missing
        return stopped or self.trouble or self.learning.news

    @property
    def _missing(self) -> str:
        """What keeps it from taking tasks, though it is in service; empty if nothing does."""
        return self._controller.missing() or self.maps.trouble(self._filter.leaders_map)

    @property
    def state(self) -> RobotState:
        """Whether it can be counted on."""
        if self._service.state is not None:
            return self._service.state
        return RobotState.IDLE if self._current is None else RobotState.BUSY

    def tell_lease_to(self, hear: Callable[[float], None]) -> None:
        """Tell how long the robot may drive [s, the talker's time], at once and at each change."""
        self._lease.tell_to(hear)

    def set_pose(self, pose: Pose) -> None:
        """Note where it is [map frame]."""
        self._pose = pose
        self.charging.note_pose(pose)

    def add_travel(self, distance: float) -> None:
        """Draw from the battery what driving a distance [m] takes with the present load."""
        mass = self._characteristics.mass + self._payload()
        force = friction_force(self._characteristics.friction_coefficient, mass)
        self._battery.update_level(force * distance)

    def set_state(self, word: str) -> None:
        """Obey an operator's word, one of `WORDS`; see `Service.set` and `Charging.send`."""
        if word.startswith(PUT_DOWN):
            self._put_down(word.removeprefix(PUT_DOWN).split())
            return
        if word not in WORDS:
            allowed = ", ".join([*WORDS, f"{PUT_DOWN} X Y YAW"])
            self._talker.refuse(SET_STATE, f"{word[:40]!r} is unknown; allowed: {allowed}")
            return
        if word == FORGET:
            self.learning.forget()
            return
        if word == "charge":
            self._go_to_charge()
            return
        self._unloading.stop()
        self.charging.abandon()
        if word == "idle" and self._service.left_on_board is not None:
            self._loads.empty()
        self._service.set(word)
        self._go_on()
        self._publish_status()

    def _put_down(self, numbers: list[str]) -> None:
        """Bring the load that was left on board to x, y and yaw [m, m, rad, map frame]."""
        place = _pose_of(numbers)
        refusal = f"allowed: {PUT_DOWN} X Y YAW [m, m, rad]"
        if place is not None:
            refusal = self._unloading.begin(place, self._lease, self._unloaded)
        if refusal:
            self._talker.refuse(SET_STATE, f"{self._id} cannot put its load down: {refusal}")
        self._publish_status()

    def _unloaded(self) -> None:
        self._go_on()
        self._publish_status()

    def _go_to_charge(self) -> None:
        if refusal := self.charging.send():
            self._talker.refuse(SET_STATE, f"{self._id} cannot go to charge: {refusal}")
            return
        self._go_on()
        self._publish_status()

    def note_trouble(self, reason: str) -> None:
        """Leave service while the robot itself says why it must; an empty reason ends that."""
        if self._service.note_trouble(reason):
            self.charging.abandon()
            self._go_on()
            self._publish_status()

    def note_contact(self, contact: Contact) -> None:
        """Note whether its body can be reached, where that is a matter of its own.

        While it cannot, the robot gives away nothing that the body may be doing. A robot whose
        body is lost is silent until it is found, so `on_robot_lost` decides about its tasks.
        """
        if contact is not self._contact:
            self._contact = contact
            self._talker.is_shut = contact is Contact.LOST
            self._go_on()
            self._publish_status()

    @property
    def _current(self) -> Entry | None:
        """The task that has begun and not ended; None if there is none."""
        entry = self._schedule.first()
        return entry if entry is not None and entry.task.id == self._controller.task_id else None

    def _why_stopped(self) -> str:
        """Say why a robot with work to do does none; empty if it works, or for another reason."""
        if waits := self._loads.others(entry.task for entry in self._schedule):
            return f"waits to hear what becomes of the load of {waits[0].task_id} on board"
        halted = self._current is None or self._controller.state is State.HALTED
        if self._schedule.first() is None or not halted or self._lease.holds():
            return ""
        return "stopped until the leader acknowledges its status"

    def _hear_broadcast(self, broadcast: Broadcast) -> None:
        if broadcast.asks(self._id):
            self._unanswered = broadcast
            self._answer()

    def _answer(self) -> None:
        """Answer the last broadcast, once the order that it mentions has come.

        Orders and broadcasts are separate topics, so a broadcast may overtake the order for what
        the robot has just won. Bids made without that order would be too low.
        """
        asked = self._unanswered
        if asked is None or asked.given_to(self._id) not in {"", self._last_order}:
            return
        self._unanswered = None
        if self._filter.obeys(asked.hive, asked.epoch):
            at_work = self._current is not None
            answer = self._respondent.answer(asked, self._pose, self._missing, at_work=at_work)
            self._talker.publish(TASK_COST, answer, self._filter.leader)

    def _obey(self, order: Order) -> None:
        if order.robot_id != self._id or not self._lease.allows(order):
            return
        entry = self._schedule.get(order.task.id)
        if self._must_wait(order, entry):
            return  # the leader repeats it
        if order.kind is not OrderKind.ASSIGN:
            self._take_back(order, entry)
            return
        if entry is not None and entry.is_of_an_earlier_task(order):
            self._drop(entry)
            entry = None
        at_work = self._current is not None
        if entry is not None and entry.is_older_than(order):
            self._schedule.renew(order)
        elif entry is not None and order.place:
            self._schedule.move(order, keep_first=at_work)
            self._publish_status()
            return
        elif entry is None and not self._reports.answer(order):
            self._make_room_for(order.task)
            self._loads.expect(order)
            loaded = is_picked(order.task, order.step) or self._loads.has(order.task)
            if loaded:
                # Before its process restarted, the robot was under way with this load.
                self._controller.stop()
            at_work = self._current is not None
            self._schedule.insert(order, self._pose, keep_first=at_work, loaded=loaded)
            self._go_on()
            self._publish_status()
        self._last_order = order.task.id
        self._answer()

    def _must_wait(self, order: Order, entry: Entry | None) -> bool:
        """Return whether an order could give away what a body out of reach may be doing."""
        current = self._current
        if self._contact is Contact.KEPT or current is None:
            return False
        return order.kind is OrderKind.ASSIGN or (entry is current and order.kind.asks_report)

    def _take_back(self, order: Order, entry: Entry | None) -> None:
        """Drop a task that is taken back; report how far it has come if the order asks for it."""
        if entry is not None and not entry.yields_to(order, self._current):
            return
        if order.kind.asks_report:
            if entry is not None or not self._reports.answer(order):
                held = entry or Entry(order, order.step)
                self._hand_back(held, f"{self._id} {TOLD_TO}")
            self._go_on()
            self._publish_status()
        elif entry is not None:
            self._drop_and_go_on(entry)
        if order.kind is OrderKind.FORGOTTEN:
            self._reports.forget(order)

    def _make_room_for(self, urgent: Task) -> None:
        """Hand back the current task if one that has just been given goes before it."""
        current = self._current
        if current is not None and may_put_off(current, urgent):
            self._hand_back(current, f"{self._id} put it off for {urgent.id}", urgent.id)

    def _compare(self, known: TaskList) -> None:
        """Drop what is no longer this robot's, and stop repeating what the hive knows."""
        if not self._filter.obeys(known.hive, known.epoch):
            return
        self._reports.acknowledge(known)
        self.charging.hear(known)
        for record in self._reports.known_of([entry.task.id for entry in self._schedule]):
            entry = self._schedule.get(record.task.id)
            if entry is not None and record.has_ended(self._id, entry.order.assignment):
                self._drop_and_go_on(entry)
            else:
                self._schedule.note_known(record)
        self._leave_unwanted()
        self._go_on()

    def _leave_unwanted(self) -> None:
        """Leave service with a load on board of a task that is not this robot's any more."""
        for load in self._loads.others(entry.task for entry in self._schedule):
            known = self._reports.known_of([load.task_id])
            hive = self._filter.hive
            wanted = any(
                (each.is_held and each.robot == self._id and load.is_of(each.task))
                or not load.is_known_to(each, hive)
                for each in known
            )
            if not wanted and self._service.left_on_board is None:
                self._leave_on_board(load.task_id, load.payload)

    def _pass_time(self, period: float) -> None:
        self.charging.pass_time(period)
        self._go_on()

    def _repeat(self) -> None:
        self._reports.repeat()
        self._filter.show()
        current = self._current
        if current is not None and current.known < current.step < current.steps:
            self._report_start(current)
        self._publish_status()

    def _go_on(self) -> None:
        """Go on with the schedule; a robot that is out of service hands it all back instead."""
        self._unloading.go_on()
        entry, current = self._schedule.first(), self._current
        loaded = current is not None and is_picked(current.task, current.step)
        loaded |= bool(self._loads.others(()))
        self.charging.consider(idle=entry is None, loaded=loaded)
        if self._service.state is not None:
            reason = f"{self._id} is out of service: {self._service.reason}"
            for held in tuple(self._schedule) if self._contact is Contact.KEPT else ():
                self._hand_back(held, reason)
        elif self._current is not None:
            self._controller.go_on()
        elif entry is not None and self._may_go():
            self._report_start(entry)
            self.learning.begin_task(entry.task, entry.step, self._pose)
            self._controller.run(
                entry.task, entry.step, self._step_done, self._task_ended, self._may_go
            )

    def _may_go(self) -> bool:
        """Return whether the next step of the first task may be done now."""
        entry = self._schedule.first()
        if entry is None or self._loads.others([entry.task]):
            return False
        return self._lease.holds() and entry.is_announced

    def _before_step(self, number: int, step: TaskStep) -> TaskStep:
        """Write down what the arm is about to do; return the step as the arm is asked for it.

        Nor does a last step begin whose report could not be written: it would be done again after
        a restart.
        """
        entry = self._current
        if entry is None:
            return self._unloading.as_asked(number, step)  # or a drive to a charger
        if number == entry.steps - 1:
            self._loads.check_writable()
        return step if step.kind is StepKind.MOVE else self._loads.begin(entry.order, number, step)

    def _step_done(self, step: int) -> None:
        entry = self._schedule.first()
        assert entry is not None  # noqa: S101  (the controller runs only what is on the schedule)
        arm_time = self._characteristics.arm_time(split_task(entry.task)[step - 1].kind)
        self._battery.update_level(self._characteristics.arm_power * arm_time)
        self._schedule.advance(entry.task.id, step)
        entry = self._current
        if entry is not None and step < entry.steps:
            self._report_start(entry)

    def _task_ended(self, result: CommandResult) -> None:
        entry = self._schedule.first()
        assert entry is not None  # noqa: S101  (the controller runs only what is on the schedule)
        if result.state is CommandState.SUCCEEDED:
            self._schedule.remove(entry.task.id)
            self.learning.end_task(entry.task.id)
            self._loads.end(entry.task)
            self._reports.add(entry.update(TaskState.DONE))
        else:
            self._hand_back(entry, f"{self._id}: {result.state.value}: {result.text}")
        if result.state is CommandState.OCCUPIED:
            self._service.leave_unknown_on_board(result.text)
        self._go_on()
        self._publish_status()

    def _drop(self, entry: Entry) -> bool:
        """Take a task off the schedule and stop it; return whether its load may be on board.

        A robot with a load that nobody wants leaves service.
        """
        if entry is self._current:
            self._controller.stop()
        else:
            # Its process may have begun the task before it restarted, and the base drives on.
            self._controller.stop_base()
        loaded = is_picked(entry.task, entry.step) or self._loads.has(entry.task)
        if loaded:
            self._leave_on_board(entry.task.id, entry.task.payload)
        self._schedule.remove(entry.task.id)
        return loaded

    def _leave_on_board(self, task_id: str, payload: float) -> None:
        """Leave service with the load of a task [kg], which an arm may be about to take.

        An arm goes on when the robot's process restarts. Whoever comes to take the load off must
        not find an arm that takes it later.
        """
        self._controller.stop_arm()
        self._service.leave_on_board(task_id, payload)

    def _drop_and_go_on(self, entry: Entry) -> None:
        self._drop(entry)
        self._go_on()
        self._publish_status()

    def _hand_back(self, entry: Entry, reason: str, put_off_for: str = "") -> None:
        """Give a task back to the hive; one whose load is on board needs a person.

        `put_off_for` is the id of the more urgent task that it makes room for.
        """
        state = TaskState.WAITING
        if self._drop(entry):
            state = TaskState.FAILED
            weight = f"{entry.task.payload:g} kg"
            is_sure = is_picked(entry.task, entry.step)
            where = f"{'is' if is_sure else 'may be'} on board at {self._pose}"
            reason += f"; its load of {weight} {where}: take it off"
        self._reports.add(entry.update(state, reason=reason, put_off_for=put_off_for))

    def _payload(self) -> float:
        """Return what is on board [kg]."""
        entry = self._current
        if entry is not None:
            return load_during(entry.task, entry.step)
        known = sum(load.payload for load in self._loads.others(()))
        return self._service.left_on_board or known

    def _report_start(self, entry: Entry) -> None:
        started = entry.update(TaskState.STARTED, **self._schedule.promise(self._pose))
        self._talker.publish(TASK_STATE, started, self._filter.leader)

    def _publish_status(self) -> None:
        self._talker.publish(ROBOT_STATUS, self.status, self._filter.carriers)


def _pose_of(numbers: list[str]) -> Pose | None:
    """Return the pose of x, y and yaw as texts; None if they are none."""
    try:
        pose = Pose(*map(float, numbers)) if len(numbers) == 3 else None  # noqa: PLR2004  (x, y, yaw)
    except ValueError:
        return None
    return None if pose is None or pose.flaw else pose
