# SPDX-License-Identifier: BSD-3-Clause
"""Shortens a plan: takes a few robots out that hinder each other and plans them in another order.

This is large neighbourhood search (Li et al., Anytime Multi-Agent Path Finding via Large
Neighborhood Search, IJCAI 2021). A neighbourhood is a robot that loses time and those that are in
its way if it goes as if alone. The new plans are kept if they are better together.
"""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_navigation.mapf.fleet import Fleet

SMALLEST, LARGEST = 2, 8  # robots of a neighbourhood
TRIED = 0.7  # how much less likely a robot is chosen again each time it did not help
RARELY = 0.05  # and not less likely than this


def improve(fleet: Fleet, movable: Sequence[int], tries: int, gain: float) -> None:
    """Make a plan shorter.

    Args:
        fleet: The robots, all planned.
        movable: Those whose plans may change.
        tries: How many neighbourhoods to look at.
        gain: By how much one has to get shorter [s].
    """
    chance = random.Random(len(movable))  # noqa: S311  (the same plan for the same robots)
    weights = dict.fromkeys(movable, 1.0)
    for _ in range(tries):
        delays = [fleet.delay(robot) * weights[robot] for robot in movable]
        if sum(delays) < gain:
            return
        seed = chance.choices(movable, delays)[0]
        robots = _neighbours(fleet, seed, movable, chance)
        better = _replan(fleet, robots, chance, gain)
        weights[seed] = 1.0 if better else max(weights[seed] * TRIED, RARELY)


def _neighbours(
    fleet: Fleet, seed: int, movable: Sequence[int], chance: random.Random
) -> list[int]:
    """Return a robot and some of those that hinder it."""
    size = min(chance.randint(SMALLEST, LARGEST), len(movable))
    allowed = set(movable)
    robots = [seed]
    for robot in robots:
        others = [k for k in fleet.hinder(robot) if k in allowed and k not in robots]
        chance.shuffle(others)
        robots += others[: size - len(robots)]
    while len(robots) < size:
        robot = chance.choice(movable)
        if robot not in robots:
            robots.append(robot)
    return robots


def _replan(fleet: Fleet, robots: Sequence[int], chance: random.Random, gain: float) -> bool:
    """Plan some robots anew; return whether it is better, else nothing changed."""
    most = sum(fleet.cost(robot) for robot in robots) - gain
    spent = sum(fleet.least(robot) for robot in robots)  # and what is to be spent at least
    order = list(robots)
    if chance.random() < 0.5:  # noqa: PLR2004  (evenly)
        chance.shuffle(order)
    if spent > most:
        return False
    before = {robot: fleet.take(robot) for robot in robots}
    for robot in order:
        spent -= fleet.least(robot)
        path = fleet.find(robot, most - spent)
        if path is None:
            break
        fleet.put(robot, path)
        spent += fleet.cost(robot)
        if spent > most:
            break
    else:
        return True
    for robot in robots:
        if fleet.paths[robot] is not None:
            fleet.take(robot)
    for robot in robots:
        fleet.put(robot, before[robot])
    return False
