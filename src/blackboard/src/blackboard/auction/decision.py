# SPDX-License-Identifier: BSD-3-Clause
"""What an auction decides about one task, with all bids: the answer to "why?"."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from blackboard.costing.cost import COST_MODELS
from blackboard.domain.bid import MAX_COST, Bid, CostTerms, Exclusion, ranked
from blackboard.domain.task import TaskType

if TYPE_CHECKING:
    from collections.abc import Iterable

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
    """Return the decision in plain data.

    Raises:
        KeyError, TypeError: There is none in it.
    """
    bids = tuple(Bid(**{**bid, "terms": _terms(bid["terms"])}) for bid in values["bids"])
    return Decision(**{**values, "bids": bids, "silent": tuple(values["silent"])})


def _terms(values: dict[str, Any] | None) -> CostTerms | None:
    """Return terms; records of older programs have no `added_charge`."""
    return CostTerms(**{"added_charge": values["energy_charge"], **values}) if values else None


def what_would_help(task: Task, bids: Iterable[Bid]) -> str:
    """Return in words what would let some robot take a task; empty if the bids do not tell.

    Robots that only lack charge or are only out of service are named first: they are there.
    """
    robots: dict[str, list[str]] = {}
    for bid in bids:
        robots.setdefault(bid.exclusion, []).append(bid.robot_id)
    kind = TaskType(task.type)
    with_arm = " with its arm" if kind.picks else ""
    told = {
        Exclusion.CHARGE: f"to charge {_listed(robots.get(Exclusion.CHARGE, ()))}",
        Exclusion.SERVICE: f"to put {_listed(robots.get(Exclusion.SERVICE, ()))} back in service",
        Exclusion.WAY: "to clear the way, or another goal",
        Exclusion.PAYLOAD: f"a robot that carries {task.payload:g} kg{with_arm}",
        Exclusion.TYPE: f"a robot that does {kind.name}",
    }
    helps = [words for exclusion, words in told.items() if exclusion in robots]
    if Exclusion.PAYLOAD in robots and Exclusion.TYPE in robots:
        helps.remove(told[Exclusion.TYPE])
    return ", or ".join(helps)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(sorted(names))
