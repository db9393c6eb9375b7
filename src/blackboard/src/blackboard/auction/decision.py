# SPDX-License-Identifier: BSD-3-Clause
"""What an auction decides about one task, with all bids: the answer to "why?"."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from blackboard.costing.cost import COST_MODELS
from blackboard.domain.bid import MAX_COST, Bid, CostTerms, Exclusion, ranked
from blackboard.domain.task import TaskType

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Sequence

    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.task import Task


@dataclass(frozen=True, slots=True)
class Decision:
    """What one round of an auction decides about one task."""

    task_id: str
    epoch: int  # of the blackboard that decided
    auction: int  # its number within the epoch
    round: int  # of the auction
    at: float  # when [s]
    winner: str = ""  # the robot that got the task; empty if no robot could take it
    reason: str = ""  # in words, if no robot could take it or it did not go to the lowest bid
    bids: tuple[Bid, ...] = ()  # the robots' bids, in the order of their names
    silent: tuple[str, ...] = ()  # robots that did not answer in time
    parts: tuple[str, ...] = ()  # ids of the parts into which it is split

    @property
    def number(self) -> tuple[int, int, int]:
        """Epoch, auction and round, in which decisions follow each other."""
        return self.epoch, self.auction, self.round


def replayed(decision: Decision, model: str) -> list[Bid]:
    """Return what the robots would have bid by another cost model, the cheapest first.

    `model` is a name of `COST_MODELS`. The tasks keep the places that were bid for.
    """
    cost = COST_MODELS[model].cost
    return ranked(
        replace(bid, cost=min(cost(bid.terms), MAX_COST)) if bid.is_able and bid.terms else bid
        for bid in decision.bids
    )


def from_plain(values: dict[str, Any]) -> Decision:
    """Return the decision in plain data; that of an older program has no `parts`.

    Raises:
        KeyError, TypeError: There is none in it.
    """
    bids = tuple(Bid(**{**bid, "terms": _terms(bid["terms"])}) for bid in values["bids"])
    lists = {key: tuple(values.get(key, ())) for key in ("silent", "parts")}
    return Decision(**{**values, "bids": bids, **lists})


def _terms(values: dict[str, Any] | None) -> CostTerms | None:
    """Return terms; records of older programs have no `added_charge`."""
    return CostTerms(**{"added_charge": values["energy_charge"], **values}) if values else None


def what_would_help(task: Task, bids: Iterable[Bid], fleet: Iterable[RobotStatus] = ()) -> str:
    """Return in words what would let some robot take a task; empty if nothing is known.

    Robots that are there and could do it are named. Only if there is none, the words say what a
    robot needs to be able to do.

    Args:
        task: The task that no robot can take.
        bids: The robots' bids on it.
        fleet: The last statuses of all robots. Robots that have made no bid may be out of service.
    """
    excluded = {bid.robot_id: bid.exclusion for bid in bids}
    robots: dict[str, list[str]] = {}
    for status in fleet:
        name, bid = status.robot_id, excluded.get(status.robot_id)
        if bid in {None, Exclusion.SERVICE}:
            excluded[name] = _exclusion_of(status, task, was_silent=bid is None)
    for name in sorted(excluded):
        robots.setdefault(excluded[name], []).append(name)
    told = {
        Exclusion.CHARGE: "more charge for {}",
        Exclusion.SERVICE: "{} back in service",
        _SILENCE: "an answer from {}",
        Exclusion.WAY: "a clear way for {}, or another goal",
    }
    helps = [
        words.format(_listed(robots[exclusion]))
        for exclusion, words in told.items()
        if exclusion in robots
    ]
    if Exclusion.COST in robots:  # a robot could do it, and nobody knows what makes it cheaper
        return ", or ".join(helps)
    return ", or ".join(helps) or _ability(task, robots)


_SILENCE = "silence"
"""Why a robot in service has made no bid, beside the values of `Exclusion`."""


def _exclusion_of(status: RobotStatus, task: Task, *, was_silent: bool) -> str:
    """Return why a robot has not bid; `was_silent` if it has said nothing, not even a refusal."""
    most = status.most_payload(TaskType(task.type))
    if most is None:
        return Exclusion.NONE if was_silent else Exclusion.SERVICE
    if most < 0.0:
        return Exclusion.TYPE
    if most < task.payload:
        return Exclusion.PAYLOAD
    return _SILENCE if was_silent and status.state.in_service else Exclusion.SERVICE


def _ability(task: Task, excluded: Container[str]) -> str:
    kind = TaskType(task.type)
    if Exclusion.PAYLOAD in excluded:
        return f"a robot that carries {task.payload:g} kg" + " with its arm" * kind.picks
    return f"a robot that does {kind.name}" if Exclusion.TYPE in excluded else ""


def _listed(names: Sequence[str]) -> str:
    """Return names in words: robot1, robot2 or robot3."""
    *others, last = names
    return f"{', '.join(others)} or {last}" if others else last
