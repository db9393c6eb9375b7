# SPDX-License-Identifier: BSD-3-Clause
"""A dense fleet whose traffic planner is killed, with lasers and the real follower, no ROS."""

from __future__ import annotations

from functools import cache

import pytest

pytest.importorskip("ompl")

from hive_lab.fleets.coordination import CoordinatorMaker
from hive_lab.fleets.crowd import Crowd
from hive_lab.fleets.faulty_traffic import TAKEOVER, Fault, FaultyTraffic
from hive_lab.fleets.sites import drawn_site

MODELS = ("ld60", "mir100")
ROBOTS, SECONDS, KILLED = 8, 40.0, 20.0
LONGER = TAKEOVER + 5.0  # nobody stands for longer because of it [s]

STORE = drawn_site(
    "store",
    (16.0, 12.0),
    [(x, y, x + 4.0, y + 1.0) for x in (3.0, 9.0) for y in (2.8, 5.6, 8.4)],
    room=0.6,
)


@cache
def maker():
    """Return what makes traffic planners for the store."""
    return CoordinatorMaker(STORE, MODELS)


def drive(seed, faults):
    """Let robots drive to one goal after the other; return them all."""

    def traffic(simulation, site):
        return FaultyTraffic(simulation, site.grid, maker(), faults, seed)

    crowd = Crowd(ROBOTS, seed, STORE, MODELS, traffic)
    crowd.run(SECONDS)
    return crowd


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_nobody_touches_and_nobody_stands_longer_than_the_takeover_and_five_seconds(seed):
    without = drive(seed, ())
    killed = drive(seed, (Fault("killed", KILLED, KILLED),))

    assert killed.simulation.collisions == 0
    assert max(killed.longest_stand.values()) <= max(without.longest_stand.values()) + LONGER
    assert all(not each.outcome for each in killed.drives)
    assert len({each.robot for each in killed.drives if each.ended > KILLED}) > ROBOTS / 3
