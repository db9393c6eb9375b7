# SPDX-License-Identifier: BSD-3-Clause
"""Keeps the robots of a hive driving: tours through the stations of its world."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

from blackboard.domain.task import Task, TaskType
from fleet_manager.config.places import places_of
from fleet_manager.errors import NoHiveError

if TYPE_CHECKING:
    from fleet_manager.client.client import HiveClient

_GOALS = 4
_SPARE = 2
_SEED = 1


class Tours:
    """Keeps more tours on the list than there are robots.

    Attributes:
        unanswered: Tours posted in vain, as to a hive that has no leader for a while.
    """

    def __init__(self, client: HiveClient, robots: int, world: str) -> None:
        """Post none yet; tours lead through the stations of a world, its name or its file."""
        self._client = client
        self._wanted = robots + _SPARE
        places = places_of(world).items()
        self._goals = [pose for name, pose in places if "charger" not in name]
        self._draw = random.Random(_SEED)
        self._ids: list[str] = []
        self.unanswered = 0

    def refill(self) -> None:
        """Post tours until enough are unfinished."""
        states = (self._client.state.state_of(task_id) for task_id in self._ids)
        open_now = sum(state is None or not state.is_terminal for state in states)
        for _ in range(self._wanted - open_now):
            task_id = f"tour-{len(self._ids) + 1}"
            goals = tuple(self._draw.sample(self._goals, _GOALS))
            self._ids.append(task_id)
            try:
                self._client.submit(Task(task_id, TaskType.GAB, goals))
            except NoHiveError:
                self.unanswered += 1
                return
