# SPDX-License-Identifier: BSD-3-Clause
"""One node decides everything; robots only execute, one task at a time."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.auction.central import Central
from blackboard.auction.plan_maker import PlanMaker
from blackboard.auction.step import PLANS, WORTH, MakePlan
from blackboard.costing.bid_basis import Bids
from blackboard.costing.cost import measure_for
from blackboard.domain.settings import BlackboardSettings
from blackboard.domain.talker import NEW_TASK, ROBOT_STATUS, TASK_COST, TASK_STATE
from blackboard.domain.task import TaskState
from hive_lab.architectures.task_book import LOST, TaskBook
from hive_lab.architectures.worker import Worker
from hive_lab.virtual.inline_searcher import InlineSearcher

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence
    from random import Random

    from blackboard.auction.search.planned import Planned
    from blackboard.costing.bid_basis import BidBasis
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.record import TaskRecord, TaskUpdate
    from blackboard.domain.talker import Talker
    from blackboard.domain.task import Task
    from hive_lab.architectures.trial import Trial

DISPATCHER = "dispatcher"

_SETTINGS = BlackboardSettings()
_LOOK = 1.0  # time between two looks for lost robots and lost orders [s]
_TELL_ANEW = 10.0  # a robot tells what it is and has learned at least so often [s]


class DispatchedRobot(Worker):
    """Tells the dispatcher how it is, and does the one task that it is given."""

    def start(self) -> None:
        """Begin to listen, and to tell how it is."""
        super().start()
        self.talker.every(_TELL_ANEW, self.task_ended)
        self.task_ended()

    @property
    def listeners(self) -> Collection[str]:
        """The dispatcher."""
        return (DISPATCHER,)

    def task_ended(self) -> None:
        """Tell what it is, and what it has learned."""
        told = Bids(self.name, 0, 0, (), basis=self.basis)
        self.talker.publish(TASK_COST, told, self.listeners)


class Dispatcher:
    """Plans for all robots together, and orders each its next task when it is free.

    It plans with what the hive's leader plans with. The lists are its own: a robot knows of one
    task.

    Args:
        talker: Of the node.
        path_lengths_for: Gives the path lengths for a robot of a radius [m].
        radius: Of the smallest robot [m].
        cost_model: Of the robots, which says what plans minimize.
    """

    def __init__(
        self,
        talker: Talker,
        path_lengths_for: Callable[[float], PathLengths],
        radius: float,
        cost_model: str,
    ) -> None:
        self._talker = talker
        self._book = TaskBook(talker, DISPATCHER, path_lengths_for(radius))
        self._lists: dict[str, tuple[str, ...]] = {}  # what each robot does next, by plan
        self._bases: dict[str, BidBasis] = {}
        self._heard: dict[str, float] = {}
        self._plans = 0
        self._quiet_plans = 0  # plans in a row that have gained nothing
        self._is_planning = False
        central = Central(
            self._book.records.get, path_lengths_for, talker.date, _SETTINGS.most_bids
        )
        searcher = InlineSearcher(talker)
        self._planner = PlanMaker(
            talker, central, measure_for(cost_model), searcher, self._follow, self._plan
        )

    def start(self) -> None:
        """Begin to listen."""
        subscribe, every = self._talker.subscribe, self._talker.every
        subscribe(NEW_TASK, self._take_in)
        subscribe(TASK_COST, self._hear_basis)
        subscribe(ROBOT_STATUS, self._hear_status)
        subscribe(TASK_STATE, self._hear_update)
        every(_LOOK, self._look)
        every(_SETTINGS.improve_period, self._improve)
        self._planner.lead()

    def _take_in(self, task: Task) -> None:
        if not self._book.take_in(task):
            return
        self._planner.note_task()
        if not self._is_planning:
            self._plan()

    def _hear_basis(self, told: Bids) -> None:
        if told.basis is not None:
            self._bases[told.robot_id] = told.basis

    def _hear_status(self, status: RobotStatus) -> None:
        self._book.hear_status(status)
        self._heard[status.robot_id] = self._talker.now()
        basis = self._bases.get(status.robot_id)
        if basis is not None:
            now = replace(basis, pose=status.pose, charge=status.charge)
            self._bases[status.robot_id] = now

    def _hear_update(self, update: TaskUpdate) -> None:
        changed = self._book.hear_update(update)
        if changed is None:
            return
        if changed.state is not TaskState.STARTED:
            self._quiet_plans = 0
            self._give()
        if changed.state is TaskState.WAITING:
            self._plan()

    def _look(self) -> None:
        self._book.repeat()
        lost = self._book.release_lost()
        if lost or (self._unlisted() and not self._is_planning):
            self._plan()
        self._give()

    def _plan(self) -> None:
        """Plan everything that no robot has."""
        self._begin(self._book.waiting(), improves=False)

    def _improve(self) -> None:
        """Plan the lists again, while that pays."""
        if not self._is_planning and self._quiet_plans < PLANS:
            self._begin(self._book.waiting(), improves=True)

    def _begin(self, records: Sequence[TaskRecord], *, improves: bool) -> None:
        names = {name for name in self._bases if self._is_alive(name)}
        if not records or not names:
            return
        self._plans += 1
        listed = {task_id: name for name, row in self._lists.items() for task_id in row}
        planned = tuple(
            replace(record, state=TaskState.ASSIGNED, robot=listed[record.task.id])
            if listed.get(record.task.id) in names
            else record
            for record in records
        )
        bases = {name: self._basis(name) for name in sorted(names)}
        self._is_planning = True
        self._planner.begin(MakePlan(bases, planned, improves, (0, self._plans)))

    def _basis(self, name: str) -> BidBasis:
        """Return what a robot has told, with the list that it has by plan."""
        held = [(record.task.id, record.step) for record in self._book.held_by(name)]
        row = [
            (task_id, self._book.records[task_id].step) for task_id in self._lists.get(name, ())
        ]
        return replace(self._bases[name], at_work=bool(held), tasks=(*held, *row))

    def _follow(self, plan: Planned) -> None:
        self._is_planning = False
        if plan.gain > WORTH:
            self._quiet_plans = 0
            waiting = {record.task.id for record in self._book.waiting()}
            rows: dict[str, list[str]] = {}
            for place in plan.places:
                if place.record.task.id in waiting:
                    rows.setdefault(place.robot, []).append(place.record.task.id)
            self._lists = {name: tuple(row) for name, row in rows.items()}
        else:
            self._quiet_plans += 1
        self._give()

    def _give(self) -> None:
        """Order every robot that has nothing to do the next task on its list."""
        for name, row in self._lists.items():
            if row and self._is_alive(name) and next(self._book.held_by(name), None) is None:
                self._lists[name] = row[1:]
                self._book.give(row[0], name)

    def _unlisted(self) -> bool:
        listed = {task_id for row in self._lists.values() for task_id in row}
        return any(record.task.id not in listed for record in self._book.waiting())

    def _is_alive(self, name: str) -> bool:
        return self._talker.now() - self._heard.get(name, -LOST) < LOST


class CentralFleet:
    """A dispatcher and its robots in a trial; see `trial.Architecture`."""

    coordinator = DISPATCHER

    def __init__(self, trial: Trial) -> None:
        model = trial.choices.cost_model
        talker = trial.boot(DISPATCHER)
        Dispatcher(talker, trial.path_lengths(), trial.least_radius, model).start()
        for name, robot in trial.robots.items():
            path_lengths = trial.path_lengths()(robot.characteristics.radius)
            DispatchedRobot(robot, trial.boot(name), path_lengths, model).start()

    def receivers(self, _: Random) -> None:
        """Post to whoever listens, which only the dispatcher does."""
