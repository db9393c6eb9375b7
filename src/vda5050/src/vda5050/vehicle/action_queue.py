# SPDX-License-Identifier: BSD-3-Clause
"""The actions of an order: when each may begin, and what they keep the vehicle from.

Source: VDA 5050 3.0, 6.2.2 "Action blocking types and sequence", figure 11.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import attrs

from vda5050.protocol.actions import ActionState, ActionStatus, BlockingType

if TYPE_CHECKING:
    from collections.abc import Iterable

    from vda5050.protocol.actions import Action
    from vda5050.protocol.factsheet import ActionScope
    from vda5050.vehicle.ports import Job, Tools

_ALONE = {BlockingType.SINGLE, BlockingType.HARD}
STANDING = {BlockingType.SOFT, BlockingType.HARD}
"""What is done only while the vehicle stands."""


@attrs.define
class _Entry:
    """One action of the order and how far it is."""

    action: Action
    scope: ActionScope
    status: ActionStatus = ActionStatus.WAITING
    triggered: bool = False  # the vehicle has come to its node or edge
    result: str | None = None
    job: Job | None = None

    @property
    def is_open(self) -> bool:
        """Whether it was triggered and has not ended."""
        return self.triggered and not self.status.ended

    def end(self, status: ActionStatus, result: str = "") -> None:
        self.status, self.result, self.job = status, result or None, None


class ActionQueue:
    """The actions of one order."""

    def __init__(self, tools: Tools) -> None:
        self._tools = tools
        self._entries: dict[str, _Entry] = {}
        self._queue: list[_Entry] = []  # triggered and not ended, in the order of their coming

    @property
    def states(self) -> tuple[ActionState, ...]:
        """How far each action is."""
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

    @property
    def is_done(self) -> bool:
        """Whether every action has ended."""
        return all(each.status.ended for each in self._entries.values())

    @property
    def is_working(self) -> bool:
        """Whether an action is under way."""
        return any(each.job is not None for each in self._queue)

    @property
    def lets_drive(self) -> bool:
        """Whether no action keeps the vehicle from driving."""
        return not any(each.action.blocking_type in STANDING for each in self._queue)

    def clear(self) -> None:
        """Forget all actions; the vehicle has a new order."""
        self._entries.clear()
        self._queue.clear()

    def expect(self, actions: Iterable[Action], scope: ActionScope) -> None:
        """Take note of actions of the order; those that are known stay as they are."""
        for action in actions:
            self._entries.setdefault(action.action_id, _Entry(action, scope))

    def keep_only(self, ids: set[str]) -> None:
        """Forget the actions that were waiting and whose ids are not among these."""
        for action_id, entry in list(self._entries.items()):
            is_ahead = entry.status is ActionStatus.WAITING and not entry.triggered
            if is_ahead and action_id not in ids:
                del self._entries[action_id]

    def trigger(self, actions: Iterable[Action]) -> None:
        """Let actions begin as soon as they may; the vehicle has come to their place."""
        for action in actions:
            entry = self._entries.get(action.action_id)
            if entry is not None and not entry.triggered and not entry.status.ended:
                entry.triggered = True
                self._queue.append(entry)

    def leave_edge(self, actions: Iterable[Action]) -> None:
        """End the actions of an edge that the vehicle leaves."""
        for action in actions:
            entry = self._entries.get(action.action_id)
            if entry is None or entry.status.ended:
                continue
            if entry.job is None or entry.job.cancel():
                entry.end(ActionStatus.FINISHED, "the edge is at its end")

    def step(self, *, is_standing: bool, is_paused: bool) -> None:
        """Begin what may begin and take in what has ended."""
        for entry in self._queue:
            if entry.job is not None and entry.job.outcome is not None:
                done, text = entry.job.outcome
                entry.end(ActionStatus.FINISHED if done else self._failed(entry.action), text)
        self._queue = [each for each in self._queue if each.is_open]
        if is_paused:
            return
        for entry in self._queue:
            if entry.status is not ActionStatus.WAITING:
                if entry.action.blocking_type in _ALONE:
                    return
                continue
            if not self._may_begin(entry, is_standing=is_standing):
                return
            entry.job, entry.status = self._tools.start(entry.action), ActionStatus.RUNNING
            if entry.action.blocking_type in _ALONE:
                return

    def _may_begin(self, entry: _Entry, *, is_standing: bool) -> bool:
        blocking = entry.action.blocking_type
        if blocking in STANDING and not is_standing:
            return False
        return blocking not in _ALONE or not self.is_working

    def _failed(self, action: Action) -> ActionStatus:
        return ActionStatus.RETRIABLE if action.retriable else ActionStatus.FAILED

    def pause(self) -> None:
        """Pause what can be paused."""
        for entry in self._queue:
            if entry.job is not None and entry.job.pause():
                entry.status = ActionStatus.PAUSED

    def resume(self) -> None:
        """Go on with what was paused."""
        for entry in self._queue:
            if entry.job is not None and entry.status is ActionStatus.PAUSED:
                entry.job.resume()
                entry.status = ActionStatus.RUNNING

    def retry(self, action_id: str, *, skip: bool) -> bool:
        """Try an action that failed again, or give it up; return whether it may be tried."""
        entry = self._entries.get(action_id)
        if entry is None or entry.status is not ActionStatus.RETRIABLE:
            return False
        if skip:
            entry.end(ActionStatus.FAILED, "skipped")
        else:
            entry.end(ActionStatus.WAITING)
        return True

    def cancel(self) -> None:
        """End everything; an action that cannot be cancelled goes on to its end."""
        for entry in self._entries.values():
            if not entry.status.ended and (entry.job is None or entry.job.cancel()):
                entry.end(ActionStatus.FAILED, "the order was cancelled")
        self._queue = [each for each in self._queue if each.is_open]
