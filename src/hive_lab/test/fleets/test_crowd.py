# SPDX-License-Identifier: BSD-3-Clause
"""The crowd that measures navigation drives, and no robot touches another."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("ompl")

from hive_lab.fleets.crowd import Crowd


def test_twenty_robots_all_drive_in_the_hall_and_touch_nothing() -> None:
    crowd = Crowd(20)
    before = crowd.simulation.poses

    crowd.run(4.0)

    moved = [
        name
        for name, pose in crowd.simulation.poses.items()
        if math.dist(pose[:2], before[name][:2]) > 0.5
    ]
    assert len(crowd.simulation.names) == 20
    assert len(moved) > 12
    assert crowd.simulation.collisions == 0
