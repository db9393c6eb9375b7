# SPDX-License-Identifier: BSD-3-Clause
"""Looks for schedules that notice a mutation, as if none were known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from hive_lab.fault_schedules.directed import DIRECTED
from hive_lab.fault_schedules.directed_over_zenoh import OVER_ZENOH
from hive_lab.fault_schedules.draw import draw
from hive_lab.fault_schedules.mutations import (
    charging,
    elections,
    forgetting,
    hives,
    recovery,
    work,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hive_lab.fault_schedules.mutations.mutation import Mutation
    from hive_lab.fault_schedules.schedule import FaultSchedule

MUTATIONS: tuple[Mutation, ...] = (
    *elections.MUTATIONS,
    *hives.MUTATIONS,
    *work.MUTATIONS,
    *forgetting.MUTATIONS,
    *charging.MUTATIONS,
    *recovery.MUTATIONS,
)
"""All of them, as docs/protocol.md lists them."""


@dataclass(frozen=True)
class Found:
    """The result of a search.

    Attributes:
        schedules: How many ran.
        where: The schedule that has noticed the mutation; empty if none did.
        broken: The property that broke, and how.
    """

    schedules: int
    where: str = ""
    broken: str = ""


def search(mutation: Mutation, most: int, *, zenoh: bool = False) -> Found:
    """Run a changed program through schedules until a property breaks.

    First come the schedules that were written by hand, then those that are drawn in the
    mutation's scenario, from the seed 0 on.

    Args:
        mutation: The change.
        most: How many schedules run at most.
        zenoh: Whether the messages go over Zenoh.
    """
    schedules = _schedules(mutation, zenoh=zenoh)
    for number, (name, schedule) in zip(range(1, most + 1), schedules, strict=False):
        broken = mutation.broken_in(schedule)
        if broken and not mutation.broken_without(schedule):
            return Found(number, name, broken)
    return Found(most)


def _schedules(mutation: Mutation, *, zenoh: bool) -> Iterator[tuple[str, FaultSchedule]]:
    yield from (OVER_ZENOH if zenoh else DIRECTED).items()
    seed = 0
    while True:
        yield f"{seed} {mutation.scenario}".strip(), draw(seed, mutation.scenario, zenoh=zenoh)
        seed += 1
