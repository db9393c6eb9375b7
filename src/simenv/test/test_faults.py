# SPDX-License-Identifier: BSD-3-Clause
"""Faults at will: each does what it says, ends again, and says what is wrong with a bad one."""

from __future__ import annotations

import math
from random import Random

import numpy as np
import pytest

from hive_common.pose import Pose
from robot_description.models import load_model
from simenv.errors import SimenvError
from simenv.faults import KINDS, Fault, inject
from simenv.simulation import Simulation
from simenv.world.world_file import load_world


@pytest.fixture
def lab() -> Simulation:
    simulation = Simulation(load_world("lab"), seed=1)
    simulation.add_robot("robot1", load_model("youbot"), (5.0, 3.0, 0.0))
    simulation.add_robot("robot2", load_model("ld60"), (12.0, 9.0, 0.0))
    return simulation


def driven(simulation: Simulation, name: str = "robot1") -> float:
    """Return how far a robot comes in 2 s of driving ahead [m]."""
    start = simulation.poses[name].x
    for _ in range(80):
        simulation.set_command(name, vx=0.5)
        simulation.step()
    return simulation.poses[name].x - start


def test_a_frozen_robot_stands_still_until_it_is_let_go(lab: Simulation) -> None:
    driven(lab)

    said = inject(lab, Fault("freeze", "robot1"))

    assert "stands still" in said
    assert driven(lab) == 0.0

    inject(lab, Fault("freeze", "robot1", 0.0))

    assert driven(lab) > 0.7


def test_only_the_robot_that_is_named_freezes(lab: Simulation) -> None:
    inject(lab, Fault("freeze", "robot1"))

    assert driven(lab, "robot2") > 0.7


def test_slipping_wheels_count_a_way_that_was_not_driven(lab: Simulation) -> None:
    inject(lab, Fault("slip", "robot1", 0.5))

    way = driven(lab)

    assert way == pytest.approx(lab.odometry("robot1").x / 2, rel=0.1)


def test_a_blind_laser_measures_nothing_until_it_is_uncovered(lab: Simulation) -> None:
    inject(lab, Fault("blind", "robot1"))

    assert np.all(lab.scan("robot1") == -math.inf)

    inject(lab, Fault("blind", "robot1", 0.0))

    assert np.any(np.isfinite(lab.scan("robot1")))


def test_the_next_grips_fail_as_often_as_was_said(lab: Simulation) -> None:
    inject(lab, Fault("pick", "robot1", 2.0))

    assert lab.arm("robot1").fail_next == 2


def test_what_stands_in_the_way_is_bumped_into_until_it_is_taken_away(lab: Simulation) -> None:
    crate = Fault("block", "crate", area=(5.6, 2.5, 6.0, 3.5))
    inject(lab, crate)

    assert driven(lab) < 0.5

    inject(lab, Fault("block", "crate", 0.0))

    assert driven(lab) > 0.7


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (Fault("explode", "robot1"), "'explode': not known; allowed: freeze, slip, blind, pick"),
        (Fault("freeze", "robot9"), "'robot9': not known; in the simulation: robot1, robot2"),
        (Fault("freeze", "robot1", 0.5), "0.5; allowed: 1 for on, 0 for off"),
        (Fault("slip", "robot1", 2.0), "allowed: a share from 0 to 1"),
        (Fault("slip", "robot1", math.nan), "not a finite number"),
        (Fault("pick", "robot1", 1.5), "a whole number"),
        (Fault("pick", "robot2", 1.0), "robot2 has no arm"),
        (Fault("block", "crate"), "x_min, y_min, x_max, y_max"),
        (Fault("block", "crate", area=(6.0, 0.0, 5.0, 1.0)), "each max above its min"),
        (Fault("block", "crate", area=(4.9, 2.9, 5.1, 3.1)), "robot1 stands there"),
        (Fault("block", "nothing", 0.0), "not there"),
    ],
)
def test_a_fault_that_makes_no_sense_is_refused_in_one_line(
    lab: Simulation, fault: Fault, message: str
) -> None:
    with pytest.raises(SimenvError, match=message) as refusal:
        inject(lab, fault)

    assert "\n" not in str(refusal.value)


ODD = (math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, -1.0, 0.0, 0.5, 1.0, 2.0, 1e6)
NAMES = ("robot1", "robot2", "nobody", "", "x" * 5000, "a b", "/robot1", "\x00", "east")


@pytest.mark.parametrize("seed", range(2))
def test_odd_faults_and_robots_are_refused_in_words_or_simulated(
    lab: Simulation, seed: int
) -> None:
    random, refused = Random(seed), 0
    for _ in range(400):
        name, value = random.choice(NAMES), random.choice(ODD)
        area = tuple(random.choices(ODD, k=random.choice((0, 3, 4, 4, 4))))
        pose = Pose(*random.choices((*ODD, 4.0, 6.0), k=3))
        try:
            if random.choice((True, False)):
                inject(lab, Fault(random.choice([*KINDS, "none"]), name, value, area))
            else:
                lab.add_robot(name, load_model("youbot"), pose)
        except SimenvError:
            refused += 1
        lab.step()
    assert 200 < refused < 400
    assert all(not pose.flaw for pose in lab.poses.values())
