# SPDX-License-Identifier: BSD-3-Clause
"""The instant actions of a vehicle, and how far each is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import attrs

from vda5050.protocol.actions import ActionState, ActionStatus

if TYPE_CHECKING:
    from collections.abc import Callable

    from vda5050.protocol.actions import Action
    from vda5050.vehicle.ports import Job, Outcome

_KEPT = 20
"""So many ended instant actions are still told of."""


@attrs.define
class _Entry:
    """One instant action, and what ends it."""

    action: Action
    poll: Callable[[], Outcome | None]
    status: ActionStatus = ActionStatus.RUNNING
    result: str | None = None


class InstantActions:
    """The instant actions that came in, the latest last."""

    def __init__(self) -> None:
        self._entries: dict[str, _Entry] = {}

    @property
    def states(self) -> tuple[ActionState, ...]:
        """How far each is."""
        return tuple(
            ActionState(
                action_id=each.action.action_id,
                action_status=each.status,
                action_type=each.action.action_type,
                action_descriptor=each.action.action_descriptor,
                action_result=each.result,
            )
            for each in self._entries.values()
        )

    def knows(self, action_id: str) -> bool:
        """Return whether an action came before: whoever sends it again gets it once."""
        return action_id in self._entries

    def add(self, action: Action, poll: Callable[[], Outcome | None]) -> None:
        """Add an action that has begun; `poll` says how it ended, or None while it runs."""
        self._entries[action.action_id] = _Entry(action, poll)
        self.step()

    def add_job(self, action: Action, job: Job) -> None:
        """Add an action that a tool does."""
        self.add(action, lambda: job.outcome)

    def step(self) -> None:
        """Take in what has ended, and forget the oldest of the many that have."""
        for entry in self._entries.values():
            if not entry.status.ended and (outcome := entry.poll()) is not None:
                entry.status = ActionStatus.FINISHED if outcome.done else ActionStatus.FAILED
                entry.result = outcome.text or None
        ended = [key for key, each in self._entries.items() if each.status.ended]
        for key in ended[:-_KEPT]:
            del self._entries[key]

    def clear_ended(self) -> None:
        """Forget all that have ended."""
        self._entries = {k: e for k, e in self._entries.items() if not e.status.ended}
