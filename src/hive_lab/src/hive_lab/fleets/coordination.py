# SPDX-License-Identifier: BSD-3-Clause
"""A traffic planner for simulated fleets."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hive_lab.fleets.traffic import Traffic
from hive_navigation.mapf.roadmap_builder import build_roadmap
from hive_navigation.planning.clearance import ClearanceField
from hive_navigation.traffic.lock_resolver import ResolvingCoordinator
from robot_description.models import load_model

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.zone import Zone
    from hive_lab.fleets.sites import Site
    from simenv.simulation import Simulation


class CoordinatorMaker:
    """Makes coordinators for one place and one kind of fleet; they share a roadmap."""

    def __init__(self, site: Site, models: Sequence[str], zones: Sequence[Zone] = ()) -> None:
        self._field = ClearanceField.of(site.grid)
        radii = sorted({load_model(name).base.circumscribed_radius for name in models})
        self._roadmap = build_roadmap(self._field, radii, zones)

    def coordinator(self, epoch: int = 1) -> ResolvingCoordinator:
        """Return a coordinator that knows no robot yet."""
        return ResolvingCoordinator(self._field, self._roadmap, epoch)


def by_a_plan(
    models: Sequence[str], zones: Sequence[Zone], simulation: Simulation, site: Site
) -> Traffic:
    """Return navigation of robots of some models with a traffic planner that knows zones."""
    return Traffic(simulation, site.grid, CoordinatorMaker(site, models, zones).coordinator())
