# SPDX-License-Identifier: BSD-3-Clause
"""Who searches for plans: a process beside the leader, so that a plan delays no heartbeat."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from blackboard.auction.search.offers import Offers
    from blackboard.auction.search.problem import Plan, Problem
    from blackboard.domain.path_lengths import Field, FieldJob


class Job(NamedTuple):
    """What a search begins with.

    Attributes:
        problem: The figures.
        plan: The lists as they are.
        measure: What to make small, a name of `domain.settings.MEASURE_NAMES`.
        move: What it counts to give a listed task to another robot [s].
        seed: Of chance, 0..2^32 - 1.
        rounds: The number of rounds.
        seconds: Processor time after which the search ends earlier, as it is counted.
        share: The same, as a share of the mean time until a task is done by the auction's plan.
    """

    problem: Problem
    plan: Plan
    measure: str
    move: float
    seed: int
    rounds: int
    seconds: float
    share: float


class Found(NamedTuple):
    """What a search has found.

    Attributes:
        plan: The best lists.
        before: Cost of the lists as they were; infinite if a task was on none.
        auctioned: Cost if what is on no list is auctioned, one task after the other.
        after: Cost of the plan.
        spent: Processor time [s], as it is counted.
        offers: What each task takes each robot, by the plan.
    """

    plan: Plan
    before: float
    auctioned: float
    after: float
    spent: float
    offers: Offers


class Searcher(Protocol):
    """Searches for one plan at a time, and computes the distance fields for it."""

    def start(self) -> None:
        """Get ready: this member leads now."""

    def search(self, job: Job, done: Callable[[Found | None], None]) -> None:
        """Begin a search in place of the one before, which is dropped.

        `done` is called later with what was found, or with None if the search failed.
        """

    def fields(self, job: FieldJob, done: Callable[[Sequence[Field] | None], None]) -> None:
        """Begin to compute distance fields, as `search` begins a search."""

    def drop(self) -> None:
        """Drop the search; its `done` is not called."""

    def stop(self) -> None:
        """Drop the search, and let go of everything: this member does not lead any more."""
