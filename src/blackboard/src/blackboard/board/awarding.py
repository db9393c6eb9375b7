# SPDX-License-Identifier: BSD-3-Clause
"""What a result of an auction changes: tasks are assigned, split, or wait with a reason."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.auction.decision import Decision, what_would_help
from blackboard.auction.splitting import split
from blackboard.domain.task import TaskEvent, TaskState, unused_goals
from blackboard.errors import SplitRefusedError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from blackboard.auction.auction import Result
    from blackboard.consensus.node import RaftNode
    from blackboard.domain.record import TaskRecord


def assigned(result: Result, node: RaftNode, now: float) -> Iterator[TaskRecord]:
    """Return the records of the tasks that robots have won.

    `now` is the time on the clock of `Task.posted` [s].
    """
    for bid in result.awards:
        record = node.get(bid.task_id)
        after = record and record.after(
            TaskEvent.ASSIGN,
            robot=bid.robot_id,
            assignment=record.assignment + 1,
            eta=bid.eta,
            step_eta=0.0,
            predicted_at=now,
            reason=unused_goals(record.task),
        )
        if after is not None:
            yield after


def unassigned(result: Result, node: RaftNode, in_service: frozenset[str]) -> list[TaskRecord]:
    """Return the records that change because no robot can take a task.

    A task that is too heavy for every robot is split; others get a new reason.
    """
    changed: list[TaskRecord] = []

    def is_taken(task_id: str) -> bool:
        return node.get(task_id) is not None or any(each.task.id == task_id for each in changed)

    for task_id, obstacles in result.impossible:
        record = node.get(task_id)
        if record is None or record.state is not TaskState.WAITING:
            continue
        bids = result.bids.get(task_id, ())
        reason = obstacles
        try:
            if divided := split(record, bids, in_service, is_taken, node.earlier):
                changed += divided
                continue
        except SplitRefusedError as error:
            reason += f"; {error}"
        if helps := what_would_help(record.task, bids):
            reason += f"; what would help: {helps}"
        if record.reason != reason:
            changed.append(replace(record, reason=reason))
    return changed


def decisions(result: Result, others: Iterable[TaskRecord], now: float) -> Iterator[Decision]:
    """Return the decisions of a round to be noted, with those of `unassigned`."""
    given = [(bid.task_id, bid.robot_id, result.reason) for bid in result.awards]
    refused = [(each.task.id, "", each.reason) for each in others if not each.parts]
    for task_id, winner, reason in given + refused:
        yield Decision(
            task_id,
            *result.auction,
            at=now,
            winner=winner,
            reason=reason,
            bids=tuple(result.bids.get(task_id, ())),
            silent=tuple(sorted(result.silent)),
        )
