# SPDX-License-Identifier: BSD-3-Clause
"""What a robot's arm has taken on board, or may have: known again after a restart.

A load is picked once and put down once. So before the arm moves, the robot writes down what it is
about to take. Every action of the arm has an id, which stays the same when the robot asks for it
again; the arm's server remembers the ids and does no action twice. Where the robot is not sure
what is on board, it tells the arm to look first.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.domain.record import Hold, Load
from blackboard.domain.task import StepKind, split_task
from blackboard.errors import JournalError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.consensus.journal import Journal
    from blackboard.domain.record import Order
    from blackboard.domain.talker import Talker
    from blackboard.domain.task import Task, TaskStep


class Loads:
    """The loads of one robot, as its journal keeps them."""

    def __init__(self, talker: Talker, journal: Journal) -> None:
        self._talker = talker
        self._journal = journal
        self._hold = journal.load_hold()
        self._is_first = True

    def has(self, task: Task) -> bool:
        """Return whether the load of a task may be on board."""
        return self._find(task) is not None

    def others(self, tasks: Iterable[Task]) -> tuple[Load, ...]:
        """Return the loads that may be on board of other tasks than some."""
        own = tuple(tasks)
        return tuple(load for load in self._hold.loads if not any(map(load.is_of, own)))

    def expect(self, order: Order) -> None:
        """Take in an order for a task that is not on the schedule.

        If its pick has begun, this robot has begun it before its process restarted, and a robot
        that has lost its journal knows it from nowhere else.
        """
        steps = split_task(order.task)
        begun = order.step < len(steps) and steps[order.step].kind is StepKind.PICK
        if begun and not self.has(order.task):
            self._change(self._with(_load_of(order)))

    def begin(self, order: Order, number: int, step: TaskStep) -> TaskStep:
        """Return an arm's step as the arm is asked for it, once it is written down.

        `number` is that of the step among those of its task.

        Raises:
            JournalError: It cannot be written down, so the arm must not move.
        """
        known = self._find(order.task)
        self._is_first = known is None
        load = known or _load_of(order)
        if known is None and step.kind is StepKind.PICK:
            hold = self._with(load)
            self._journal.save_hold(hold)
            self._hold = hold
        look = known is not None or not self._hold.sure
        return replace(step, action=f"{load.name}/{number}", look=look)

    def check_writable(self) -> None:
        """Raise JournalError if the end of a task could not be written down now."""
        self._journal.save_hold(self._hold)

    def miss(self, task: Task, *, looked: bool) -> None:
        """Note that the load of a task was not taken.

        `looked` says whether the arm says so; else it did not get the last request, which says
        nothing of requests before it.
        """
        if looked or self._is_first:
            self._change(replace(self._hold, loads=self.others([task])))

    def end(self, task: Task) -> None:
        """Note that the load of a task is put down."""
        if self.has(task):
            self._change(Hold(self.others([task]), sure=True))

    def empty(self) -> None:
        """Note that a person says that nothing is on board."""
        self._change(Hold(sure=True))

    def _with(self, load: Load) -> Hold:
        return replace(self._hold, loads=(*self._hold.loads, load))

    def _find(self, task: Task) -> Load | None:
        return next((load for load in self._hold.loads if load.is_of(task)), None)

    def _change(self, hold: Hold) -> None:
        """Write down what the robot can do without: it asks its arm or a person once more."""
        if hold == self._hold:
            return
        self._hold = hold
        try:
            self._journal.save_hold(hold)
        except JournalError as error:
            self._talker.warn(f"after a restart the loads on board may be unclear: {error}")


def _load_of(order: Order) -> Load:
    """Return the load of an ordered task."""
    task = order.task
    return Load(task.id, task.payload, order.hive, order.assignment, task.posted)
