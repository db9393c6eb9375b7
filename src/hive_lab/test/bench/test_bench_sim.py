# SPDX-License-Identifier: BSD-3-Clause
"""The benchmark of the simulation drives as many robots as it says, and tells of contacts."""

from __future__ import annotations

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from hive_lab.bench import system
from hive_lab.bench.simulator import drive, spawn_robots
from hive_lab.live import simulator


def no_link(_record: object) -> None:
    """Open no link: nothing in these tests drives a hive."""


def driven(contacts: float) -> dict[str, float]:
    """Return what a run with contacts measures."""
    figures = dict.fromkeys(("cpu", "memory", "slowness", "driving_share", "unanswered"), 0.5)
    return {**figures, "real_time_factor": 6.0, "contacts": contacts}


def test_a_hundred_robots_find_room_and_drive() -> None:
    simulation = spawn_robots(100)
    before = simulation.poses

    drive(simulation, 0.3, lasers=True)

    moved = [name for name, pose in simulation.poses.items() if pose != before[name]]
    assert len(simulation.names) == 100
    assert len(moved) > 90


@pytest.mark.parametrize("contacts", [0.0, 1.0])
def test_bench_sim_is_broken_by_a_contact(
    monkeypatch: pytest.MonkeyPatch, contacts: float
) -> None:
    monkeypatch.setattr(simulator, "measure_in_process", lambda: {"4": 0.0})
    monkeypatch.setattr(simulator, "_simulator_alone", lambda: {"speed_node_4": 0.0})
    monkeypatch.setattr(simulator, "AIMS", {})
    monkeypatch.setattr(simulator, "run_apart", lambda *_: driven(contacts))

    result = simulator.run(no_link)

    assert (result.figures["ros_4 contacts"], result.broken) == (contacts, contacts > 0)
    assert result.met["ros_4 contacts"] is not result.broken


@pytest.mark.parametrize("contacts", [(0.0, 0.0), (1.0, 0.0), (0.0, 2.0)])
def test_bench_system_is_broken_by_a_contact_at_either_speed(
    monkeypatch: pytest.MonkeyPatch, contacts: tuple[float, float]
) -> None:
    runs = [driven(each) for each in contacts]
    monkeypatch.setattr(system, "run_apart", lambda *_: runs.pop(0))

    result = system.run(no_link)

    assert (result.figures["contacts"], result.figures["fast contacts"]) == contacts
    assert result.broken is (sum(contacts) > 0)


def test_bench_system_is_broken_by_a_contact_of_a_fleet_that_drives_at_one_speed_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(system, "run_apart", lambda *_: driven(1.0))

    assert system.run(no_link, robots=20).broken
