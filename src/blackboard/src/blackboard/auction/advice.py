# SPDX-License-Identifier: BSD-3-Clause
"""What would help where nobody can take a task."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.domain.bid import Exclusion
from blackboard.domain.task import TaskType

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.domain.bid import Bid
    from blackboard.domain.task import Task


def what_would_help(task: Task, bids: Iterable[Bid]) -> str:
    """Return in words what would let somebody take a task; empty where that cannot be told.

    Robots that only lack charge or are only out of service are named first: they are there.

    Args:
        task: That nobody can take.
        bids: What the robots answered, each with why it is excluded.
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
