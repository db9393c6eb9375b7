# SPDX-License-Identifier: BSD-3-Clause
"""Posts the tasks of a scenario when they are due."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.domain.record import TaskRecord, TaskUpdate
    from blackboard.domain.task import TaskState
    from fleet_manager.client.client import HiveClient
    from fleet_manager.config.scenario import PlannedTask


class Feeder:
    """Posts planned tasks one after the other, by the hive's clock, which starts now.

    Args:
        client: Posts the tasks.
        tasks: In the order in which they are posted.

    Attributes:
        states: The hive's first word on each posted task, by id.
    """

    def __init__(self, client: HiveClient, tasks: Iterable[PlannedTask]) -> None:
        self.states: dict[str, TaskState] = {}
        self._client = client
        self._waiting = deque(tasks)
        self._start = client.link.hive_time()

    @property
    def done(self) -> bool:
        """Whether every task has been posted."""
        return not self._waiting

    def next_in(self, most: float) -> float:
        """Return the time until the next task is due, `most` at most [s]."""
        if not self._waiting:
            return most
        return min(max(self._waiting[0].after - self._elapsed(), 0.0), most)

    def post_due(self) -> dict[str, TaskUpdate | TaskRecord]:
        """Post the tasks that are due; return the hive's answer to each, by id.

        Raises:
            NoHiveError: No blackboard answered.
            NotDoneError: An id is on the task list already, for another task.
        """
        answers: dict[str, TaskUpdate | TaskRecord] = {}
        while self._waiting and self._waiting[0].after <= self._elapsed():
            task = self._waiting[0].task
            answers[task.id] = self._client.submit(task)
            self.states[task.id] = answers[task.id].state
            self._waiting.popleft()
        return answers

    def _elapsed(self) -> float:
        """Return the time since the scenario began [s]."""
        return self._client.link.hive_time() - self._start
