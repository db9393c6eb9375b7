# SPDX-License-Identifier: BSD-3-Clause
"""When a robot answers a broadcast: as soon as it has on its list what it has just won.

Order and broadcast are on topics of their own, so the broadcast may overtake the order. Bids that
were made for the list without it would be too low.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.domain.record import Broadcast


class Answering:
    """Has broadcasts answered that ask this robot.

    Args:
        robot_id: Which robot.
        answer: Bids on what was broadcast.
    """

    def __init__(self, robot_id: str, answer: Callable[[Broadcast], None]) -> None:
        self._robot_id = robot_id
        self._answer = answer
        self._postponed: Broadcast | None = None
        self._last_ordered = ""

    def hear(self, broadcast: Broadcast) -> None:
        """Answer a broadcast, now or when the order has come that it speaks of."""
        if not broadcast.asks(self._robot_id):
            return
        self._postponed = broadcast
        self._answer_if_ready(broadcast)

    def note_order(self, task_id: str) -> None:
        """Note that an order to take a task has been heard and dealt with."""
        self._last_ordered = task_id
        if self._postponed is not None:
            self._answer_if_ready(self._postponed)

    def _answer_if_ready(self, broadcast: Broadcast) -> None:
        if broadcast.given_to(self._robot_id) in {"", self._last_ordered}:
            self._postponed = None
            self._answer(broadcast)
