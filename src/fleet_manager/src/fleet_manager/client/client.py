# SPDX-License-Identifier: BSD-3-Clause
"""How a program outside the hive posts tasks and follows them.

ROS loses what is published right after a publisher was made, and the blackboard may be changing
hands at that moment. So what is asked for is repeated, with the same id, until the blackboard
answers; the same task twice is harmless by the hive's contract.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

from blackboard.domain.task import TaskState
from fleet_manager.client.hive_view import HiveView
from fleet_manager.errors import NoHiveError, NotDoneError, TimeUpError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from blackboard.domain.record import TaskRecord, TaskUpdate
    from blackboard.domain.task import Task
    from fleet_manager.client.hive_view import Report

DEFAULT_URI = "http://localhost:11311"
"""Address of the ROS master where the user has given none: what catkin's setup.bash sets."""

REPEAT_EVERY = 0.5
"""Time between two publications of the same request [s]; a late repetition costs one message."""

ANSWER_WITHIN = 6.0
"""Time for the blackboard's answer [s]; longer than a takeover with its 2 s of silence."""

STATUS_PERIOD = 1.5
"""Every robot in service says how it is within this time [s]; robot_status comes at 1 Hz."""


class Link(Protocol):
    """The port between a client and the hive's topics; one thread uses it."""

    def now(self) -> float:
        """Return a clock that never jumps [s]."""

    def hive_time(self) -> float:
        """Return the hive's time [s], which is the simulator's where there is one."""

    def post(self, task: Task) -> None:
        """Publish a task on `new_task`, once."""

    def cancel(self, task_id: str) -> None:
        """Publish a task's id on `task_cancel`, once."""

    def receive(self, timeout: float) -> Report | None:
        """Return the next thing the hive said, or None after `timeout` [s]."""


class HiveClient:
    """Asks the hive for something and says what came of it.

    Attributes:
        view: What the hive has said so far.
        link: The way to the hive.
    """

    def __init__(
        self,
        link: Link,
        on_report: Callable[[HiveView, Report], None] = lambda _view, _report: None,
    ) -> None:
        """Use a link that is connected already.

        Args:
            link: The way to the hive.
            on_report: Called with each report and the view as it was before it.
        """
        self.view = HiveView()
        self.link = link
        self._on_report = on_report

    def pump(self, until: Callable[[], bool], timeout: float | None) -> bool:
        """Take in what the hive says until something is so.

        Args:
            until: Asked before the first report and after each.
            timeout: Longest wait [s]; None for no limit.

        Returns:
            Whether it came to be so before the time was up.
        """
        end = None if timeout is None else self.link.now() + timeout
        while not until():
            left = REPEAT_EVERY if end is None else end - self.link.now()
            if left <= 0:
                return False
            report = self.link.receive(min(left, REPEAT_EVERY))
            if report is not None:
                self._on_report(self.view, report)
                self.view.take_in(report)
        return True

    def submit(self, task: Task) -> TaskUpdate | TaskRecord:
        """Post a task until the blackboard has answered.

        Args:
            task: The task; its id should be new. It is posted with the time it is now.

        Returns:
            The blackboard's first word on it, REJECTED included.

        Raises:
            NoHiveError: No blackboard answered.
            NotDoneError: The id is on the list already, for another task.
        """
        task = replace(task, posted=self.link.hive_time())
        answered = lambda: self.view.state_of(task.id) is not None  # noqa: E731  (one expression)
        if not self._repeat(lambda: self.link.post(task), answered):
            raise self._no_answer(f"task {task.id} may not be on the list")
        record = self.view.tasks.get(task.id)
        if record is None:
            return self.view.answers[task.id]
        if not record.task.asks_the_same_as(task):
            raise NotDoneError(f"task id {task.id} is taken by another task; choose another id")
        return record

    def cancel(self, task_id: str) -> None:
        """Take a task off the list.

        Args:
            task_id: The task.

        Raises:
            NoHiveError: No blackboard answered.
            NotDoneError: There is no such task, or it has ended already.
        """
        self.fetch_tasks()
        record = self.view.tasks.get(task_id)
        if record is None:
            known = ", ".join(list(self.view.tasks)[-5:]) or "none"
            raise NotDoneError(f"no task {task_id}; the newest on the list: {known}")
        if record.state.is_terminal:
            raise NotDoneError(f"task {task_id} is {record.state.name} already")

        def state() -> TaskState:
            return self.view.state_of(task_id) or record.state

        if not self._repeat(lambda: self.link.cancel(task_id), lambda: state().is_terminal):
            raise self._no_answer(f"task {task_id} may not be cancelled")
        if state() is not TaskState.CANCELLED:
            became = f"task {task_id} became {state().name}"
            raise NotDoneError(f"{became} before it could be cancelled")

    def fetch_tasks(self) -> None:
        """Wait until the blackboard's list is in the view.

        Raises:
            NoHiveError: No list came.
        """
        if not self.pump(lambda: self.view.version is not None, ANSWER_WITHIN):
            raise self._no_answer("its list is unknown")

    def fetch_robots(self) -> None:
        """Wait until every robot that is in service has said how it is.

        Raises:
            NoHiveError: Neither a robot nor a blackboard was heard.
        """
        self.pump(lambda: False, STATUS_PERIOD)
        if not self.pump(lambda: bool(self.view.robots or self.view.heartbeat), ANSWER_WITHIN):
            raise self._no_answer("no robot was heard either")

    def follow(self, ids: Iterable[str], timeout: float | None) -> dict[str, TaskState]:
        """Wait until tasks have ended.

        Args:
            ids: Tasks that the blackboard has answered.
            timeout: Longest wait [s]; None for no limit.

        Returns:
            The state each ended in.

        Raises:
            TimeUpError: Some have not ended; the text says where they stand.
        """
        ids = list(ids)

        def states() -> dict[str, TaskState]:
            return {i: self.view.state_of(i) or TaskState.WAITING for i in ids}

        if not self.pump(lambda: all(s.is_terminal for s in states().values()), timeout):
            left = [f"{i} is {s.name}" for i, s in states().items() if not s.is_terminal]
            raise TimeUpError(f"not ended after {timeout:g} s: {', '.join(left)}")
        return states()

    def _repeat(self, ask: Callable[[], None], answered: Callable[[], bool]) -> bool:
        """Ask again and again until it is answered or the time for answers is up."""
        end = self.link.now() + ANSWER_WITHIN
        while self.link.now() < end:
            ask()
            if self.pump(answered, REPEAT_EVERY):
                return True
        return answered()

    def _no_answer(self, what: str) -> NoHiveError:
        heard = self.view.heartbeat
        who = f"the last one heard was {heard.leader.strip('/')}" if heard else "none was heard"
        return NoHiveError(
            f"no blackboard answers within {ANSWER_WITHIN:g} s ({who}); {what}; "
            "is the hive running?"
        )
