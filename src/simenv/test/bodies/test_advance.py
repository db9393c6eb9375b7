# SPDX-License-Identifier: BSD-3-Clause
"""Moving all robots in compiled code does what moving them one by one in the open does."""

import math
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import box

from hive_common.geometry import Footprint, outline
from hive_common.pose import Pose
from robot_description.models import load_model
from simenv.bodies.advance import CLOSE
from simenv.bodies.contact import Contacts
from simenv.testing import hall
from simenv.world.shapes import Shape
from simenv.world.surroundings import Surroundings
from simenv.world.world_content import Person

MODELS = [load_model(name) for name in ("mir100", "ld60", "youbot", "fetch")]
SHAPES = [Footprint(MODELS[index % 4].base.footprint) for index in range(8)]
ANNA = Person("anna", ((2.0, 8.5), (8.0, 8.5)), radius=0.25, speed=1.2)
NAMES = [f"robot{index}" for index in range(8)]


class Plainly:
    """Moves robots with `Footprint.touches`, one after the other."""

    def __init__(self, surroundings):
        self.walls = hall(Shape("table", box(4.0, 4.5, 6.0, 5.5))).segments
        self.obstacles = surroundings.obstacles

    def met(self, row, pose, poses, margins):
        solid = [("", self.walls), *((each.name, each.edges) for each in self.obstacles.now)]
        found = {name for name, edges in solid if SHAPES[row].touches(pose, edges, margins[row])}
        for other, shape in enumerate(SHAPES):
            edges = outline(shape.at(Pose(*poses[other])))
            if other != row and SHAPES[row].touches(pose, edges, margins[other]):
                found.add(NAMES[other])
        return found

    def advance(self, poses, ahead, shifts):
        """Return where the robots end, and what stopped each."""
        ways = np.hypot(shifts[:, 0], shifts[:, 1])
        swings = ways + [s.radius * abs(t) for s, t in zip(SHAPES, shifts[:, 2], strict=True)]
        held = [
            row
            for row in range(8)
            if self.met(row, Pose(*ahead[row]), poses, np.where(np.arange(8) == row, 0, swings))
        ]
        reached = ahead.copy()
        reached[held] = poses[held]
        stops = {}
        for row in held:
            stops[row] = self.met(row, Pose(*ahead[row]), reached, np.zeros(8))
            free, blocked, probe = (0.0, 1.0, CLOSE) if stops[row] else (1.0, 1.0, 1.0)
            while blocked - free > CLOSE:
                there = between(poses[row], ahead[row], probe)
                if met := self.met(row, there, reached, np.zeros(8)):
                    stops[row], blocked = met, probe
                else:
                    free = probe
                probe = (free + blocked) / 2
            reached[row] = between(poses[row], ahead[row], free)
        return reached, stops


def between(start, end, share):
    way = end - start
    way[2] = math.remainder(way[2], math.tau)
    return Pose(*(start + share * way))


@pytest.mark.parametrize("people", [(), (ANNA,)])
@pytest.mark.parametrize("seed", range(3))
def test_all_robots_end_where_they_would_one_by_one(seed, people):
    world = replace(hall(Shape("table", box(4.0, 4.5, 6.0, 5.5))), people=people)
    surroundings = Surroundings(world)
    contacts, plainly = Contacts(surroundings), Plainly(surroundings)
    for name, shape in zip(NAMES, SHAPES, strict=True):
        contacts.add(name, shape)
    poses = np.array([(1.5 + 2.2 * (i % 4), 2.8 + 4.2 * (i // 4), 0.7 * i) for i in range(8)])
    random, touched = np.random.default_rng(seed), 0
    for step in range(60):
        if step % 20 == 0:
            shifts = random.uniform((0.03, -0.05, -0.05), (0.15, 0.05, 0.05), (8, 3))
        if step == 30:
            surroundings.obstacles.put("crate", box(0.6, 4.6, 0.9, 5.2))
        surroundings.obstacles.step(0.025, list(zip(SHAPES, map(Pose._make, poses), strict=True)))
        cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        ahead = poses + shifts
        ahead[:, 0] = poses[:, 0] + cos * shifts[:, 0] - sin * shifts[:, 1]
        ahead[:, 1] = poses[:, 1] + sin * shifts[:, 0] + cos * shifts[:, 1]
        expected, stops = plainly.advance(poses, ahead, shifts)

        poses, shares = contacts.advance(poses, ahead, shifts)

        assert poses == pytest.approx(expected, abs=1e-9)
        assert {row for row, met in stops.items() if met} == set(np.flatnonzero(shares < 1))
        noted = {frozenset((contact.name, contact.other)) for contact in contacts.noted}
        for row, met in stops.items():
            assert {frozenset((NAMES[row], name)) for name in met} <= noted
            touched += len(met)
    assert touched > 50
    assert 3 < len(contacts.noted) < touched


def test_a_robot_may_follow_close_behind_another_that_makes_way():
    contacts = Contacts(Surroundings(hall()))
    for name in NAMES[:2]:
        contacts.add(name, SHAPES[0])
    poses = np.array([[3.0, 5.0, 0.0], [3.0 + 0.89 + 0.011, 5.0, 0.0]])
    shifts = np.array([[0.01, 0.0, 0.0], [0.02, 0.0, 0.0]])

    after, shares = contacts.advance(poses, poses + shifts, shifts)

    assert shares.tolist() == [1.0, 1.0]
    assert after.tobytes() == (poses + shifts).tobytes()


def test_a_contact_with_a_thing_that_is_gone_ends():
    surroundings = Surroundings(hall())
    contacts = Contacts(surroundings)
    contacts.add("robot0", SHAPES[0])
    surroundings.obstacles.put("crate", box(5.0, 4.0, 6.0, 6.0))
    poses, shifts = np.array([[4.5, 5.0, 0.0]]), np.array([[0.1, 0.0, 0.0]])
    poses, shares = contacts.advance(poses, poses + shifts, shifts)
    assert (shares < 1).all()
    assert contacts.touching("robot0") == ("crate",)

    surroundings.obstacles.take("crate")
    poses, shares = contacts.advance(poses, poses + shifts, shifts)

    assert shares.tolist() == [1.0]
    assert contacts.touching("robot0") == ()
