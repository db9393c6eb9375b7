# SPDX-License-Identifier: BSD-3-Clause
"""Seeded runs of a dense fleet whose traffic planner, messages and positions fail."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, NamedTuple

from hive_lab.fleets.coordination import CoordinatorMaker
from hive_lab.fleets.crowd import Crowd, robot_name
from hive_lab.fleets.faulty_traffic import FaultyTraffic, draw_faults
from hive_lab.fleets.sites import drawn_site

if TYPE_CHECKING:
    from hive_lab.fleets.faulty_traffic import Fault
    from hive_lab.fleets.sites import Site
    from simenv.simulation import Simulation

ROBOTS = 8
MODELS = ("ld60", "mir100")
SECONDS = 60.0  # how long a run lasts, simulated

STORE_SIZE = (16.0, 12.0)  # of the store in which they drive [m]
STORE_RACKS = [(x, y, x + 4.0, y + 1.0) for x in (3.0, 9.0) for y in (2.8, 5.6, 8.4)]


class FaultRun(NamedTuple):
    """What happened in a run.

    Attributes:
        seed: Of everything in it.
        faults: What failed.
        contacts: Each in a line.
        goals: How many were reached.
        longest_stand: For which a robot with a goal stood still [s].
    """

    seed: int
    faults: tuple[Fault, ...]
    contacts: tuple[str, ...]
    goals: int
    longest_stand: float


def run(seed: int) -> FaultRun:
    """Let a crowd drive in a store while things fail; the seed decides which and when."""
    site, maker = _store()
    faults = draw_faults(list(map(robot_name, range(ROBOTS))), SECONDS, seed)

    def traffic_of(simulation: Simulation, place: Site) -> FaultyTraffic:
        return FaultyTraffic(simulation, place.grid, maker, faults, seed)

    crowd = Crowd(ROBOTS, seed, site, MODELS, traffic_of)
    crowd.run(SECONDS)
    return FaultRun(
        seed,
        faults,
        tuple(map(str, crowd.simulation.contacts)),
        sum(not drive.outcome for drive in crowd.drives),
        max(crowd.longest_stand.values()),
    )


@cache
def _store() -> tuple[Site, CoordinatorMaker]:
    """Return the store, and what makes its planners; a process makes them once."""
    site = drawn_site("store", STORE_SIZE, STORE_RACKS, room=0.6)
    return site, CoordinatorMaker(site, MODELS)
