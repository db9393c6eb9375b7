# SPDX-License-Identifier: BSD-3-Clause
"""What a result of an auction changes: tasks are assigned, split, or wait with a reason."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.auction.decision import Decision, what_would_help
from blackboard.auction.splitting import part_ids, split, unsplit
from blackboard.domain.task import TaskEvent, TaskState, unused_goals
from blackboard.errors import SplitRefusedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from blackboard.auction.auction import Result
    from blackboard.board.watch import Presence
    from blackboard.consensus.node import RaftNode
    from blackboard.domain.record import TaskRecord

UNDONE = "its split is undone"
"""How the reason of a task begins that a robot gets in place of its parts."""


def assigned(
    result: Result, node: RaftNode, now: float, may_join: Callable[[TaskRecord], bool]
) -> Iterator[TaskRecord]:
    """Return the records of the tasks that robots have won.

    A robot that wins a task which is split gets all of it, if `may_join` says that its parts may
    leave the list. `now` is the time on the clock of `Task.posted` [s].
    """
    for bid in result.awards:
        record = node.get(bid.task_id)
        reason = record and unused_goals(record.task)
        if record is not None and record.parts:
            if not may_join(record):
                continue
            record, reason = unsplit(record), f"{UNDONE}: {bid.robot_id} takes all of it"
        after = record and record.after(
            TaskEvent.ASSIGN,
            robot=bid.robot_id,
            assignment=record.assignment + 1,
            eta=bid.eta,
            step_eta=0.0,
            eta_margin=0.0,
            predicted_at=now,
            reason=reason,
        )
        if after is not None:
            yield after


def unassigned(result: Result, node: RaftNode, presence: Presence) -> list[TaskRecord]:
    """Return the records that change because no robot can take a task.

    A task that is too heavy for every robot is split; others get a new reason.
    """
    in_service = presence.in_service()
    changed: list[TaskRecord] = []

    def is_taken(task_id: str) -> bool:
        return node.get(task_id) is not None or any(each.task.id == task_id for each in changed)

    for task_id, obstacles in result.impossible:
        record = node.get(task_id)
        if record is None or record.state is not TaskState.WAITING or record.parts:
            continue
        bids = result.bids.get(task_id, ())
        reason = obstacles
        try:
            if divided := split(record, bids, in_service, is_taken, node.earlier):
                changed += divided
                continue
        except SplitRefusedError as error:
            reason += f"; {error}"
        if helps := what_would_help(record.task, bids, presence.fleet()):
            reason += f"; what would help: {helps}"
        if record.reason != reason:
            changed.append(replace(record, reason=reason))
    return changed


def decisions(
    result: Result, won: Iterable[TaskRecord], others: Iterable[TaskRecord], now: float
) -> Iterator[Decision]:
    """Return the decisions of a round to be noted: those of `assigned` and of `unassigned`."""
    silent = tuple(sorted(result.silent))

    def decided(
        task_id: str, reason: str, winner: str = "", parts: Iterable[str] = ()
    ) -> Decision:
        bids = tuple(result.bids.get(task_id, ()))
        number = result.auction
        return Decision(task_id, *number, now, winner, reason, bids, silent, tuple(parts))

    for record in won:
        undone = record.reason if record.reason.startswith(UNDONE) else ""
        reason = "; ".join(filter(None, (result.reason, undone)))
        yield decided(record.task.id, reason, record.robot)
    others = tuple(others)
    wholes = {each.task.id: each for each in others if each.parts}
    for each in others:
        whole = wholes.get(each.parent)
        reason = each.division or each.reason
        if whole is not None:
            reason = f"a part of {each.parent}, which was {whole.division}"
        yield decided(each.task.id, reason, parts=part_ids(each))
