# SPDX-License-Identifier: BSD-3-Clause
"""What the command line's links on ROS and over Zenoh share; see `client.client.ClientLink`."""

from __future__ import annotations

import contextlib
import queue
import time
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Protocol

from fleet_manager.client.reports import HiveMessage
from fleet_manager.client.topics import STATE
from fleet_manager.desk.facts import CancelTask, PostTask, SetRobotState

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable

    from blackboard.domain.task import Task
    from fleet_manager.client.traffic import ZoneCommand
    from fleet_manager.desk.facts import Fact, Request

LOOK = 0.02
"""Time between two looks at what other threads have heard [s]."""


class Topics(Protocol):
    """The hive's topics, whatever carries them."""

    def listen(self, names: Iterable[str]) -> None:
        """Follow topics; those that are followed already stay as they are."""

    def speak(self, request: Request) -> None:
        """Publish a request, once."""


class TopicLink(ABC):
    """Hands over what the hive says, one report at a time, and publishes requests.

    A subclass sets `_topics`, and has them put what they hear with `_put`.
    """

    _topics: Topics

    def __init__(self) -> None:
        self._reports: queue.SimpleQueue[HiveMessage] = queue.SimpleQueue()

    @abstractmethod
    def _known_time(self) -> float:
        """Return the hive's time [s]; 0 while it is unknown."""

    def listen(self, *names: str) -> None:
        """Follow some of the hive's topics from now on; all of its state if none is named."""
        self._topics.listen(names or STATE)

    def now(self) -> float:
        """Return a monotonic time [s]."""
        return time.monotonic()

    def hive_time(self, within: float = 0.0) -> float:
        """Return the hive's time [s]; 0 if it is not known after `within` [s, wall]."""
        end = self.now() + within
        while not (time_known := self._known_time()) and self.now() < end:
            time.sleep(LOOK)
        return time_known

    def post(self, task: Task) -> None:
        """Publish a task on `new_task`, once."""
        self._ask(PostTask(task))

    def cancel(self, task_id: str) -> None:
        """Publish a task's id on `task_cancel`, once."""
        self._ask(CancelTask(task_id))

    def switch(self, command: ZoneCommand) -> None:
        """Publish a command on `zone_command`, once."""
        self._ask(command)

    def set_state(self, robot: str, word: str) -> None:
        """Publish a word on a robot's `set_state`, once."""
        self._ask(SetRobotState(robot, word))

    def receive(self, timeout: float) -> HiveMessage | None:
        """Return the next report, or None after `timeout` [s]."""
        with contextlib.suppress(queue.Empty):
            return self._reports.get(timeout=max(timeout, 0.0))
        return None

    def _ask(self, request: Request) -> None:
        self._topics.speak(request)

    def _put(self, fact: Fact, _supersedes: Hashable = None) -> None:
        if isinstance(fact, HiveMessage):
            self._reports.put(fact)
