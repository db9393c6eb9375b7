# SPDX-License-Identifier: BSD-3-Clause
"""What is left out, and who is moved at the same time, changes nothing of what happens."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import box

from hive_common.geometry import distances
from hive_common.pose import Pose
from robot_description.models import load_model
from simenv.bodies.advance import Advance
from simenv.bodies.clearance import Clearance
from simenv.errors import ObstacleError
from simenv.simulation import Simulation
from simenv.testing import hall
from simenv.world.shapes import Shape
from simenv.world.world_content import Person

MODELS = [load_model(name) for name in ("mir100", "ld60", "youbot", "fetch")]


def crowded_hall(steps=240, people=()):
    """Let eight robots and some people drive into everything; return all that happened."""
    world = replace(hall(Shape("table", box(4.0, 4.5, 6.0, 5.5))), people=people)
    simulation = Simulation(world, seed=3)
    for index in range(8):
        x, y = 1.5 + 2.2 * (index % 4), 2.8 + 4.2 * (index // 4)
        simulation.add_robot(f"robot{index}", MODELS[index % 4], Pose(x, y, 0.7 * index))
    random, taken, contacts = np.random.default_rng(5), [], []
    for step in range(steps):
        if step % 60 == 0:
            speeds = random.uniform((0.3, -0.5, -0.3), (1.5, 0.5, 0.3), (8, 3))
        if step % 20 == 0:
            for name, speed in zip(simulation.names, speeds, strict=True):
                simulation.set_command(name, *speed)
        if step == steps // 2:
            with contextlib.suppress(ObstacleError):
                simulation.block("crate", box(0.5, 4.6, 0.9, 5.2))
        if step == steps * 3 // 4:
            contacts += map(str, simulation.contacts)
            simulation.reset()
        simulation.step()
        taken.append(np.array(list(simulation.poses.values())).tobytes())
    odometry = [simulation.odometry(name) for name in simulation.names]
    return taken, odometry, contacts + [str(contact) for contact in simulation.contacts]


WALKER = Person("anna", ((2.0, 8.5), (8.0, 8.5)), radius=0.25, speed=1.2)


@pytest.mark.parametrize("people", [(), (WALKER,)])
def test_who_is_not_looked_at_touches_nothing(monkeypatch, people):
    with_fewer_looks = crowded_hall(people=people)
    monkeypatch.setattr(
        Clearance, "doubtful", lambda _self, _poses, _ways, swings: (swings > 0).nonzero()[0]
    )

    assert crowded_hall(people=people) == with_fewer_looks
    assert len(with_fewer_looks[2]) > 3


def test_who_is_moved_together_gets_as_far_as_one_after_the_other(monkeypatch):
    together = crowded_hall()
    monkeypatch.setattr(
        Advance,
        "_batches",
        lambda _self, rows, _poses, _swings: [rows[i : i + 1] for i in range(len(rows))],
    )

    assert crowded_hall() == together


def test_a_robot_with_room_around_it_is_looked_at_seldom(monkeypatch):
    looks = []
    look = Clearance._measure  # noqa: SLF001  (it has no other name)
    monkeypatch.setattr(
        Clearance, "_measure", lambda self, *args: (looks.append(args), look(self, *args))
    )
    simulation = Simulation(hall())
    simulation.add_robot("robot1", MODELS[0], Pose(3.0, 5.0, 0.0))

    for _ in range(100):
        simulation.set_command("robot1", 0.5)
        simulation.step()

    assert simulation.poses["robot1"].x > 4.0
    assert len(looks) < 5


def test_the_distance_to_a_segment_is_that_to_its_nearest_point():
    segment = [[1.0, 1.0], [3.0, 1.0]]
    point = [[2.0, 3.0], [5.0, 1.0], [0.0, 0.0], [2.0, 1.0]]

    assert distances(np.array(point), np.array([segment] * 4)) == pytest.approx(
        [2.0, 2.0, np.sqrt(2), 0.0]
    )
