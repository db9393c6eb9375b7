# SPDX-License-Identifier: BSD-3-Clause
"""The particle filter reaches its aims on simulated drives through the lab."""

import math

import pytest

pytest.importorskip("ompl")

from hive_lab.bench.localization import (
    AIMS,
    CONVERGED,
    DRIVES,
    SEARCH,
    follow,
    found_itself,
    recorded,
)
from robot_description.models import load_model

MODEL = load_model(DRIVES["testing"].model)


@pytest.fixture(scope="module")
def looks():
    return recorded(DRIVES["testing"], seed=2)


def test_with_the_usual_drift_and_noise_a_robot_knows_where_it_is(looks):
    errors = follow(MODEL, looks, seed=1).errors[CONVERGED:].mean(axis=0)

    assert errors[0] < AIMS["position"]
    assert math.degrees(errors[1]) < AIMS["heading"]


def test_the_odometry_alone_would_not_know(looks):
    """Otherwise the drive would show nothing."""
    start, end = looks[0], looks[-1]

    by_odometry = math.dist(start.odometry[:2], end.odometry[:2])
    really = math.dist(start.truth[:2], end.truth[:2])

    assert abs(by_odometry - really) > AIMS["position"]


def test_a_robot_that_was_carried_away_finds_its_pose(looks):
    assert found_itself(follow(MODEL, looks[:SEARCH], seed=3, lost=True))
