# SPDX-License-Identifier: BSD-3-Clause
"""Draws what connects a hive over Zenoh, and what happens to that."""

from __future__ import annotations

from dataclasses import replace
from random import Random
from typing import TYPE_CHECKING

from hive_lab.fault_schedules.faulty_network import Load, Quality
from hive_lab.fault_schedules.schedule import FAULT_PERIOD, SETTLE, BadLinks, RouterLoss, Site

if TYPE_CHECKING:
    from hive_lab.fault_schedules.schedule import FaultSchedule

TRANSPORTS = ROS, ZENOH = ("ros", "zenoh")

_THROUGH_ROUTERS = 0.4  # share of the schedules
_TWICE = 0.2
_LOADED = 0.5


def over_zenoh(schedule: FaultSchedule) -> FaultSchedule:
    """Return a schedule whose messages go over Zenoh, and whose connections fail besides."""
    random = Random(f"links {schedule.seed}")
    site = Site(random.random() < _THROUGH_ROUTERS, random.random() < _TWICE)
    happenings = [*schedule.happenings]
    if random.random() < _LOADED:
        happenings += [_load(random) for _ in range(random.randint(1, 3))]
    if site.routers:
        happenings += [_lose_routers(random) for _ in range(random.randint(1, 3))]
    return replace(schedule, happenings=tuple(happenings), site=site)


def _load(random: Random) -> BadLinks:
    """Draw a time in which more is said than the links carry."""
    load = Load(
        random.choice([0.05, 0.2, 1.0]),
        random.choice([0.0, 0.3, 3.0]),
        random.choice([0.5, 2.0, 8.0]),
    )
    at = SETTLE + random.uniform(0.0, FAULT_PERIOD)
    loss = random.choice([0.0, 0.2])
    return BadLinks(at, random.uniform(2.0, 15.0), Quality(loss=loss, load=load))


def _lose_routers(random: Random) -> RouterLoss:
    """Draw a loss of the routers, which are killed or hang."""
    hang = random.choice([0.0, random.uniform(0.3, 5.0)])
    return RouterLoss(SETTLE + random.uniform(0.0, FAULT_PERIOD), hang)
