# SPDX-License-Identifier: BSD-3-Clause
"""Errors and cost of the particle filter on drives through the lab.

The drives are recorded once, with the default noise and drift. The filter follows each of them
from a known start. Then it starts without knowledge in the middle of them, as for a robot that was
carried to another room and asked for `global_localization`.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hive_common.map_file import load_map
from hive_lab.bench.registry import BenchResult
from hive_lab.fleets.recording import record_drive
from hive_navigation.localization.amcl_settings import AmclSettings
from hive_navigation.localization.likelihood_field import BeamChooser, LikelihoodField
from hive_navigation.localization.localizer import Localizer
from hive_navigation.localization.particle_filter import ParticleFilter
from robot_description.models import load_model
from robot_description.scan import Scan
from simenv.world.world_file import load_world

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array
    from hive_lab.fleets.recording import Look
    from robot_description.models import RobotModel

CONVERGED = 50  # looks after which a filter with a known start counts as converged: 5 s
SEARCH = 600  # looks within which a carried robot has to find itself: 60 s
FOUND = 0.3  # a robot with a mean error below this in the last 5 s has found itself [m]
TRIES = 7  # attempts on each drive
AIMS = {"position": 0.10, "heading": 3.0, "not_found": 0.1, "cpu": 0.006}

PICK_UP_1, PICK_UP_3 = (2.2, 10.3, 1.57), (8.0, 10.3, 1.57)
BENCH_4, BENCH_5 = (6.8, 1.7, -1.57), (12.9, 1.7, -1.57)
SHELF_1, SHELF_2 = (12.7, 10.5, 1.57), (16.9, 10.5, 1.57)
CELL = (17.8, 1.6, -1.57)


@dataclass(frozen=True)
class Drive:
    """A drive of a model from the first stop to the others, frame map [m, m, rad]."""

    model: str
    stops: Sequence[tuple[float, float, float]]


DRIVES = {
    "assembly": Drive("mir100", [(2.6, 2.0, 0.0), PICK_UP_3, PICK_UP_1, BENCH_4, (2.6, 4.0, 0.0)]),
    "testing": Drive("fetch", [(12.0, 9.0, 0.0), SHELF_2, BENCH_5, CELL, SHELF_1]),
    "both": Drive("youbot", [(12.0, 3.0, 0.0), PICK_UP_1, CELL, BENCH_4, SHELF_2]),
}


def recorded(drive: Drive, seed: int) -> list[Look]:
    """Record a drive through the lab; all three take a quarter of a minute."""
    chart = load_map("lab")
    return record_drive(load_world("lab"), chart, load_model(drive.model), drive.stops, seed)


@dataclass(frozen=True)
class Followed:
    """A filter's result on a drive.

    Attributes:
        errors: (looks, 2) distance to the true position [m], and heading error [rad].
        cpu: Processor time [s].
        updates: Number of scans used.
    """

    errors: Array
    cpu: float
    updates: int


def follow(model: RobotModel, looks: Sequence[Look], seed: int, *, lost: bool = False) -> Followed:
    """Localize along a drive in the lab, from the true pose or, if `lost`, from anywhere."""
    settings = AmclSettings(odom_model_type="omni" if model.base.holonomic else "diff")
    chart = load_map("lab")
    corner = (chart.origin.x, chart.origin.y)
    field = LikelihoodField(chart.cells, chart.resolution, corner, settings)
    particles = ParticleFilter(field, settings, np.random.default_rng(seed))
    localizer = Localizer(particles, BeamChooser(model.laser, settings.laser_max_beams), settings)
    if lost:
        localizer.restart_anywhere()
    else:
        localizer.restart_at(looks[0].truth, settings.initial_covariance)
    errors, updates = [], 0
    began = time.process_time()
    for look in looks:
        updates += localizer.see(look.time, look.odometry, Scan.of(model.laser, look.ranges))
        pose = localizer.pose(look.odometry)
        turn = math.remainder(pose.yaw - look.truth.yaw, math.tau)
        errors.append((math.dist(pose[:2], look.truth[:2]), abs(turn)))
    return Followed(np.array(errors), time.process_time() - began, updates)


def found_itself(followed: Followed) -> bool:
    """Return whether a filter that started without knowledge knows its pose in the end."""
    return bool(followed.errors[-CONVERGED:, 0].mean() < FOUND)


def run(tries: int = TRIES) -> BenchResult:
    """Measure; a robot is carried away `tries` times on each drive.

    Returns:
        Errors `position` [m] and `heading` [degrees], the worst of the drives' means; `not_found`,
        the share of tries in which a lost robot did not find itself; `cpu` [s per s] at 5 Hz.
    """
    figures: dict[str, float] = {}
    lost: list[bool] = []
    cpu: list[float] = []
    for seed, (name, drive) in enumerate(DRIVES.items(), start=1):
        looks, model = recorded(drive, seed), load_model(drive.model)
        followed = follow(model, looks, seed)
        position, heading = followed.errors[CONVERGED:].mean(axis=0)
        figures[f"{name}_position"] = float(position)
        figures[f"{name}_position_worst"] = float(followed.errors[CONVERGED:, 0].max())
        figures[f"{name}_heading"] = math.degrees(heading)
        cpu.append(followed.cpu / followed.updates * AmclSettings().update_rate)
        starts = np.linspace(0, len(looks) - CONVERGED * 8, tries).astype(int)
        for start in starts:
            part = looks[start : start + SEARCH]
            lost.append(not found_itself(follow(model, part, int(start), lost=True)))
    for figure in ("position", "heading"):
        figures[figure] = max(figures[f"{name}_{figure}"] for name in DRIVES)
    figures |= {"not_found": sum(lost) / len(lost), "tries": len(lost), "cpu": max(cpu)}
    return BenchResult(figures, AIMS)
