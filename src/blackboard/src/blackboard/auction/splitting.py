# SPDX-License-Identifier: BSD-3-Clause
"""Splits a task that is too heavy for every robot into parts that robots can carry.

A part is a task like any other, with the goals and the priority of the whole and a share of its
payload. The whole is not auctioned any more; its record shows the progress of its parts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from blackboard.domain.record import TaskRecord
from blackboard.domain.task import MAX_ID_LENGTH, TaskState
from blackboard.errors import SplitRefusedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from blackboard.domain.bid import Bid
    from blackboard.domain.task import Task

MAX_PARTS = 100
"""More parts than this are almost certainly a typo in the payload."""

_GRAM = 0.001
_SETTLED = {TaskState.FAILED, TaskState.CANCELLED}


def shares(payload: float, capacities: Sequence[float]) -> tuple[float, ...]:
    """Return the fewest shares of a payload [kg] that some robots can carry, the heaviest first.

    There are as many as the strongest robot would need on its own. As far as they go, each robot
    is meant to carry one, so that robots work side by side, in proportion to what it can carry.
    The payload is above 0, each of the `capacities` [kg] at least a gram.
    """
    limits = sorted((math.floor(most / _GRAM + 1e-6) for most in capacities), reverse=True)
    rest = math.ceil(payload / _GRAM - 1e-6)
    number = math.ceil(rest / limits[0])
    crew = (limits + [limits[0]] * number)[:number]
    weakest = number - 1
    while sum(crew) < rest:
        crew[weakest] = limits[0]
        weakest -= 1
    grams = [rest * most // sum(crew) for most in crew]
    for index, most in enumerate(crew):
        grams[index] += min(most - grams[index], rest - sum(grams))
    return tuple(sorted((part * _GRAM for part in grams), reverse=True))


@dataclass(frozen=True, slots=True)
class Division:
    """Into which shares a task is split, and why."""

    shares: tuple[float, ...]  # of the payload [kg], the heaviest first
    strongest: str  # the robot that carries most
    most: float  # what that robot carries [kg]

    def __str__(self) -> str:
        weights = list(dict.fromkeys(f"{share:.4g} kg" for share in self.shares))
        told = " and ".join(weights[:1] + weights[1:][-1:])
        if len(weights) > 2:  # noqa: PLR2004  (more than the two that are told)
            told = f"{weights[-1]} to {weights[0]}"
        return (
            f"{len(self.shares)} parts of {told}, because {self.strongest} carries most, "
            f"{self.most:g} kg"
        )


def division(task: Task, most: Mapping[str, float | None]) -> Division | None:
    """Return how a task is split among robots; None if it is not too heavy for all of them.

    `most` is what each robot in service can carry of such a task [kg]: less than a gram where it
    can carry nothing of it, None where it does not say.

    Raises:
        SplitRefusedError: It is too heavy and is not split; the text says why.
    """
    able = {robot: kg for robot, kg in most.items() if kg is not None and kg >= _GRAM}
    strongest = min(able, key=lambda robot: (-able[robot], robot), default="")
    if not able or task.payload <= able[strongest]:
        return None
    strength = able[strongest]
    if task.no_split:
        raise SplitRefusedError(
            f"too heavy for any one robot ({strongest} carries most: {strength:g} kg), "
            "and it is not to be split"
        )
    if unknown := sorted(robot for robot, kg in most.items() if kg is None):
        raise SplitRefusedError(
            f"too heavy for {strength:g} kg at most, but {', '.join(unknown)} "
            "has not said what it can carry"
        )
    if task.payload > MAX_PARTS * strength:
        raise SplitRefusedError(
            f"{task.payload:g} kg would take more than {MAX_PARTS} parts of {strength:g} kg at "
            "most"
        )
    return Division(shares(task.payload, list(able.values())), strongest, strength)


def split(
    record: TaskRecord,
    bids: Iterable[Bid],
    in_service: frozenset[str],
    is_taken: Callable[[str], bool],
    earlier: int = 0,
) -> tuple[TaskRecord, ...]:
    """Return the record of a task that is split and those of its parts; none if it is not heavy.

    The bids tell what robots can carry; those `in_service` count. `earlier` is the highest number
    of an assignment that the hive has forgotten.

    Raises:
        SplitRefusedError: It is too heavy and cannot be split; the text says why.
    """
    told = {bid.robot_id: bid.most_payload or None for bid in bids}
    how = division(record.task, {robot: told.get(robot) for robot in in_service})
    if how is None:
        return ()
    parts = []
    for number, share in enumerate(how.shares, start=1):
        part_id = f"{record.task.id}.{number}"
        if is_taken(part_id) or len(part_id) > MAX_ID_LENGTH:
            raise SplitRefusedError(
                f"cannot be split, because the id {part_id} of a part is taken or longer than "
                f"{MAX_ID_LENGTH} characters; post it again with another id"
            )
        task = replace(record.task, id=part_id, payload=round(share, 3))
        parts.append(TaskRecord.new(task, earlier, parent=record.task.id))
    words = f"split into {how}"
    whole = replace(record, parts=len(parts), step=0, eta=0.0, division=words)
    return progress(whole, parts), *parts


def unsplit(whole: TaskRecord) -> TaskRecord:
    """Return the record of a task whose split is undone, so that it waits as a whole."""
    return replace(
        whole,
        state=TaskState.WAITING,
        robot="",
        parts=0,
        division="",
        step=0,
        eta=0.0,
        step_eta=0.0,
        eta_margin=0.0,
        reason="",
    )


def progress(whole: TaskRecord, parts: Sequence[TaskRecord]) -> TaskRecord:
    """Return the record of a split task, brought up to date with the records of its parts."""
    if whole.state.is_terminal:
        return whole
    done = sum(part.state is TaskState.DONE for part in parts)
    changes = {"step": done, "eta": 0.0, "step_eta": 0.0, "eta_margin": 0.0}
    ended = next((part for part in parts if part.state in _SETTLED), None)
    if ended is not None:
        word = "was cancelled" if ended.state is TaskState.CANCELLED else "failed"
        reason = f"its part {ended.task.id} {word}: {ended.reason}"
        if done + 1 < len(parts):
            reason += "; parts that have not ended go on"
        return replace(whole, state=TaskState.FAILED, reason=reason, **changes)  # type: ignore[arg-type]  # fields by name
    state = TaskState.DONE
    if done < len(parts):
        state = min(max(part.state for part in parts), TaskState.STARTED)
        left = [part for part in parts if part.state is not TaskState.DONE]
        if all(part.eta for part in left):
            last = max(left, key=lambda part: part.predicted_at + part.eta)
            changes |= {"eta": last.eta, "predicted_at": last.predicted_at}
    reason = f"{done} of {len(parts)} parts done"
    if whole.division:
        reason = f"{whole.division}; {reason}"
    return replace(whole, state=state, reason=reason, **changes)  # type: ignore[arg-type]  # fields by name


def with_wholes(
    changed: Sequence[TaskRecord], known: Mapping[str, TaskRecord]
) -> tuple[TaskRecord, ...]:
    """Return changed records, followed by those of the tasks that they are parts of.

    They change together, so that no copy of the list has one without the other.
    """
    result = {record.task.id: record for record in changed}

    def now(task_id: str) -> TaskRecord | None:
        return result.get(task_id) or known.get(task_id)

    for record in changed:
        part = record
        while (whole := now(part.parent)) is not None:
            part = progress(whole, [each for each in map(now, part_ids(whole)) if each])
            if part != whole:
                result[part.task.id] = part
    return tuple(result.values())


def part_ids(whole: TaskRecord) -> Iterable[str]:
    """Return the ids of the parts of a task; none if it was not split."""
    return (f"{whole.task.id}.{number}" for number in range(1, whole.parts + 1))


def unfinished_parts(whole: TaskRecord, known: Mapping[str, TaskRecord]) -> tuple[TaskRecord, ...]:
    """Return the parts of a task, and their parts, that have not ended."""
    found: list[TaskRecord] = []
    for part in (known[name] for name in part_ids(whole) if name in known):
        found += [] if part.state.is_terminal else [part]
        found += unfinished_parts(part, known)
    return tuple(found)
