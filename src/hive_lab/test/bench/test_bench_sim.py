# SPDX-License-Identifier: BSD-3-Clause
"""The benchmark of the simulation drives as many robots as it says."""

from __future__ import annotations

from hive_lab.bench.simulator import drive, spawn_robots


def test_a_hundred_robots_find_room_and_drive() -> None:
    simulation = spawn_robots(100)
    before = simulation.poses

    drive(simulation, 0.3, lasers=True)

    moved = [name for name, pose in simulation.poses.items() if pose != before[name]]
    assert len(simulation.names) == 100
    assert len(moved) > 90
