# SPDX-License-Identifier: BSD-3-Clause
"""Faults of one kind, drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hive_lab.fault_schedules.faulty_network import Quality
from hive_lab.fault_schedules.schedule import BadLinks, Crash, Cut, Freeze, PowerCut, SetState

if TYPE_CHECKING:
    from collections.abc import Callable
    from random import Random

    from hive_lab.fault_schedules.schedule import Happening


def any_fault(random: Random, members: tuple[str, ...], at: float) -> list[Happening]:
    """Draw a fault of any kind.

    Args:
        random: Where chances are drawn from.
        members: Whom it may hit.
        at: When it happens [s].
    """
    kind = random.choices(list(_KINDS), list(_KINDS.values()))[0]
    return kind(random, members, at)


def _crash(random: Random, members: tuple[str, ...], at: float) -> list[Happening]:
    how = random.choices(["plain", "disk lost", "for ever"], [8, 1, 1])[0]
    back_after = random.choice([0.3, 1.0, 3.0, 12.0]) * random.random()
    return [
        Crash(
            at,
            random.choice(members),
            None if how == "for ever" else back_after,
            disk_lost=how == "disk lost",
            while_writing=random.choice([True, False]),
        )
    ]


def _freeze(random: Random, members: tuple[str, ...], at: float) -> list[Happening]:
    return [Freeze(at, random.choice(members), random.choice([0.8, 3.0, 6.0, 14.0]))]


def _cut(random: Random, members: tuple[str, ...], at: float) -> list[Happening]:
    group = tuple(random.sample(members, random.randint(1, len(members) - 1)))
    others: tuple[str, ...] = ()
    if random.random() < 0.3:  # noqa: PLR2004  (a share: some cuts are between two groups only)
        rest = [name for name in members if name not in group]
        others = tuple(random.sample(rest, random.randint(1, len(rest))))
    way = random.choice([True, False])
    holds = random.choice([True, False])
    return [Cut(at, group, random.uniform(0.5, 14.0), way, others, holds)]


def _bad_links(random: Random, _: tuple[str, ...], at: float) -> list[Happening]:
    quality = Quality(
        random.choice([0.0, 0.1, 0.3, 0.5]),
        random.choice([0.0, 0.2]),
        random.choice([0.02, 0.5, 2.0]),
    )
    return [BadLinks(at, random.uniform(2.0, 20.0), quality)]


def _power_cut(random: Random, _: tuple[str, ...], at: float) -> list[Happening]:
    return [PowerCut(at, random.uniform(0.1, 5.0))]


def _defect(random: Random, members: tuple[str, ...], at: float) -> list[Happening]:
    robot = random.choice(members[1:])
    back = at + random.uniform(1.0, 15.0)
    return [SetState(at, robot, "defect"), SetState(back, robot, "idle")]


_KINDS: dict[Callable[[Random, tuple[str, ...], float], list[Happening]], int] = {
    _crash: 7,
    _freeze: 4,
    _cut: 4,
    _bad_links: 3,
    _power_cut: 1,
    _defect: 1,
}
"""How often each kind of fault comes, relative to the others."""
