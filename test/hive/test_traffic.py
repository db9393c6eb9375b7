# SPDX-License-Identifier: BSD-3-Clause
"""Robots that meet: the real planner, follower and right of way in the simulator's core.

No ROS and no clock on the wall: every robot ticks ten times per simulated second, and hears the
others 0.15 s late. A test fails when two robots touch, or when one is still on its way in the end.
"""

import collections
import random
from pathlib import Path

import pytest

from robot_description.follower import Pose, PursuitFollower
from robot_description.map_reader import read_map
from robot_description.models import load_model
from robot_description.navigator import Navigator
from robot_description.ompl_planner import OmplPlanner
from simenv.simulation import STEP, Simulation
from simenv.world import load_world

pytestmark = pytest.mark.timeout(400)  # seconds on a quiet machine, minutes on a busy one

LAB = read_map(Path(__file__).resolve().parents[2] / "maps" / "lab.yaml")
ROUND = 4
"""Steps of the simulation between two ticks of a robot."""
LATE = 6
"""Steps until the others have heard what a robot announces."""
SOUTH_DOOR = (10.0, 3.2)
WEST, EAST = 3.14, 0.0


class Fleet:
    """Robots in the lab, each with a navigator of its own."""

    def __init__(self, **robots):
        self.simulation = Simulation(load_world("lab"), seed=1)
        self.navigators = {}
        self.outcomes = {}
        self._heard = {}
        self._said = collections.deque()
        self._steps = 0
        planners = {}
        for name, (model, pose) in robots.items():
            robot = load_model(model)
            self.simulation.add_robot(name, robot, pose)
            if model not in planners:
                planners[model] = OmplPlanner(LAB, robot.base.circumscribed_radius)
            planner = planners[model]
            follower = PursuitFollower(robot.base)
            self.navigators[name] = Navigator(name, robot, planner, follower, planner.field)

    def send(self, name, goal):
        self.outcomes[name] = None
        self.navigators[name].set_goal(Pose(*goal), self.simulation.time)

    def run(self, limit):
        """Let time pass until every goal has ended, or for so many seconds; return if all have."""
        while self.simulation.time < limit:
            self._step()
            if None not in self.outcomes.values():
                return True
        return False

    def _step(self):
        for turn, (name, navigator) in enumerate(self.navigators.items()):
            if self._steps % ROUND == turn % ROUND:
                self._tick(name, navigator)
        while self._said and self._said[0][0] <= self._steps:
            said = self._said.popleft()[1]
            self._heard[said.name] = said
        self.simulation.step(STEP)
        self._steps += 1

    def _tick(self, name, navigator):
        simulation = self.simulation
        pose = Pose(*simulation.poses[name])
        heard = tuple(self._heard.values())
        tick = navigator.tick(simulation.time, pose, simulation.scan(name), heard)
        simulation.set_command(name, *tick.velocity)
        self._said.append((self._steps + LATE, tick.announcement))
        if tick.outcome is not None:
            self.outcomes[name] = tick.outcome


def check_all_reached(fleet, limit):
    ended = fleet.run(limit)
    assert ended, f"still on the way after {limit} s: {fleet.outcomes} at {fleet.simulation.poses}"
    assert all(outcome.reached for outcome in fleet.outcomes.values()), fleet.outcomes
    assert fleet.simulation.collisions == 0


@pytest.mark.parametrize("models", [("mir100", "ld60"), ("fetch", "youbot")])
def test_two_robots_that_meet_in_a_door_both_get_through(models):
    fleet = Fleet(robot1=(models[0], (7.5, 3.2, EAST)), robot2=(models[1], (12.5, 3.2, WEST)))
    fleet.send("robot1", (13.5, 3.2, EAST))
    fleet.send("robot2", (6.5, 3.2, WEST))

    check_all_reached(fleet, 120)


def test_robots_that_stand_nose_to_nose_in_a_door_come_free():
    fleet = Fleet(robot1=("mir100", (9.2, 3.2, EAST)), robot2=("ld60", (10.9, 3.2, WEST)))
    fleet.send("robot2", (6.5, 3.2, WEST))
    fleet.send("robot1", (13.5, 3.2, EAST))

    check_all_reached(fleet, 120)


def test_two_robots_can_swap_their_places():
    fleet = Fleet(robot1=("mir100", (2.6, 2.0, EAST)), robot2=("ld60", (2.6, 4.0, EAST)))
    fleet.send("robot1", (2.6, 4.0, EAST))
    fleet.send("robot2", (2.6, 2.0, EAST))

    check_all_reached(fleet, 120)


def test_an_idle_robot_in_a_door_steps_aside():
    fleet = Fleet(robot1=("mir100", (7.0, 3.2, EAST)), robot2=("fetch", (*SOUTH_DOOR, 1.57)))
    fleet.send("robot1", (13.5, 3.2, EAST))

    check_all_reached(fleet, 120)


def test_a_robot_at_work_in_a_door_stays_and_the_other_takes_the_other_door():
    fleet = Fleet(robot1=("mir100", (7.0, 3.2, EAST)), robot2=("fetch", (*SOUTH_DOOR, 1.57)))
    fleet.navigators["robot2"].parked = True
    fleet.send("robot1", (13.5, 3.2, EAST))

    check_all_reached(fleet, 160)
    x, y, _ = fleet.simulation.poses["robot2"]
    assert (x, y) == pytest.approx(SOUTH_DOOR, abs=0.01)


def test_something_that_does_not_speak_in_a_door_is_driven_around():
    fleet = Fleet(robot1=("mir100", (7.0, 3.2, EAST)), robot2=("fetch", (*SOUTH_DOOR, 1.57)))
    del fleet.navigators["robot2"]
    fleet.send("robot1", (13.5, 3.2, EAST))

    check_all_reached(fleet, 160)


def test_a_goal_in_a_wall_is_given_up_at_once_with_the_reason():
    fleet = Fleet(robot1=("mir100", (7.0, 3.2, EAST)))
    fleet.send("robot1", (10.0, 11.0, EAST))

    assert fleet.run(1.0)
    assert not fleet.outcomes["robot1"].reached
    assert "wall" in fleet.outcomes["robot1"].text


def test_four_robots_with_random_goals_all_arrive_and_never_touch():
    chance = random.Random(7)
    places = [(2.2, 9.0), (5.5, 4.0), (8.8, 5.0), (12.0, 5.6), (14.0, 5.4), (16.9, 9.0)]
    places += [(18.8, 5.6), (3.6, 5.2), (7.4, 8.6), (13.6, 8.8)]
    fleet = Fleet(
        robot1=("mir100", (2.6, 2.0, EAST)),
        robot2=("ld60", (2.6, 4.0, EAST)),
        robot3=("youbot", (12.0, 3.0, EAST)),
        robot4=("fetch", (12.0, 9.0, EAST)),
    )
    for _ in range(2):
        goals = chance.sample(places, 4)
        for name, goal in zip(fleet.navigators, goals, strict=True):
            fleet.send(name, (*goal, chance.uniform(-3.1, 3.1)))

        check_all_reached(fleet, fleet.simulation.time + 150)
