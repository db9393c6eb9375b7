# SPDX-License-Identifier: BSD-3-Clause
"""Robots that meet: real planner, follower and right of way in a simulated world, no ROS."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("ompl")

from hive_common.grid_map import GridMap
from hive_common.map_file import load_map
from hive_common.pose import Pose
from hive_lab.fleets.traffic import Traffic
from hive_navigation.control.driver import MAX_ROUND
from hive_navigation.planning.clearance import ClearanceField
from hive_navigation.traffic.neighbourhood import Neighbourhood
from robot_description.models import load_model
from simenv.simulation import Simulation
from simenv.world.world_file import load_world

LAB = {
    "robot1": ("mir100", (2.6, 2.0, 0.0)),
    "robot2": ("ld60", (2.6, 4.0, 0.0)),
    "robot3": ("fetch", (12.0, 3.0, 0.0)),
    "robot4": ("youbot", (12.0, 9.0, 0.0)),
}
CORRIDOR = """
name: corridor
size: [24.0, 6.0]
walls:
  - {name: south wall, box: [0.0, 0.0, 24.0, 0.2]}
  - {name: north wall, box: [0.0, 5.8, 24.0, 6.0]}
  - {name: west wall, box: [0.0, 0.2, 0.2, 5.8]}
  - {name: east wall, box: [23.8, 0.2, 24.0, 5.8]}
  - {name: south block, box: [6.0, 0.2, 18.0, 2.3]}
  - {name: north block, box: [6.0, 3.7, 18.0, 5.8]}
"""


def lab(robots):
    """Return the simulation of the lab and robots that navigate in it."""
    simulation = Simulation(load_world("lab"), seed=1)
    traffic = Traffic(simulation, load_map("lab"))
    for name, (model, pose) in robots.items():
        traffic.add(name, load_model(model), pose)
    return simulation, traffic


def corridor(tmp_path, robots):
    """Return the same for two rooms with a corridor too narrow for two robots."""
    (tmp_path / "corridor.yaml").write_text(CORRIDOR)
    blocked = np.zeros((120, 480), dtype=bool)
    blocked[:4] = blocked[-4:] = True
    blocked[:, :4] = blocked[:, -4:] = True
    blocked[:46, 120:360] = blocked[74:, 120:360] = True
    simulation = Simulation(load_world(str(tmp_path / "corridor.yaml")), seed=1)
    traffic = Traffic(simulation, GridMap.of_blocked(blocked, 0.05))
    for name, (model, pose) in robots.items():
        traffic.add(name, load_model(model), pose)
    return simulation, traffic


def all_arrive(simulation, traffic, seconds):
    """Return whether all robots reach their goals in time without touching anything."""
    in_time = traffic.run(seconds)
    return (
        in_time
        and all(outcome.reached for outcome in traffic.outcomes.values())
        and simulation.collisions == 0
    )


@pytest.mark.parametrize(
    "models", [("mir100", "ld60"), ("mir100", "mir100"), ("fetch", "youbot")], ids="-".join
)
def test_two_robots_head_on_in_a_door_both_get_through(models):
    one, other = models
    simulation, traffic = lab({"a": (one, (7.5, 3.2, 0.0)), "b": (other, (12.5, 3.2, 3.14))})
    traffic.send("a", (13.5, 3.2, 0.0))
    traffic.send("b", (6.5, 3.2, 3.14))

    assert all_arrive(simulation, traffic, 60)


def test_two_robots_nose_to_nose_in_a_door_get_apart():
    robots = {"a": ("mir100", (9.2, 3.2, 0.0)), "b": ("ld60", (10.9, 3.2, 3.14))}
    simulation, traffic = lab(robots)
    traffic.send("b", (6.5, 3.2, 3.14))
    traffic.send("a", (13.5, 3.2, 0.0))

    assert all_arrive(simulation, traffic, 60)


def test_two_robots_can_swap_places():
    simulation, traffic = lab({"a": LAB["robot1"], "b": LAB["robot2"]})
    traffic.send("a", (2.6, 4.0, 0.0))
    traffic.send("b", (2.6, 2.0, 0.0))

    assert all_arrive(simulation, traffic, 60)


def test_an_idle_robot_in_a_doorway_moves_aside():
    robots = {"a": ("mir100", (7.0, 3.2, 0.0)), "b": ("fetch", (10.0, 3.2, 1.57))}
    simulation, traffic = lab(robots)
    traffic.send("a", (13.5, 3.2, 0.0))

    assert all_arrive(simulation, traffic, 30)


@pytest.mark.parametrize("x", [5.4, 5.45, 5.5])
def test_a_robot_that_has_picked_makes_room_for_one_that_waits_for_its_place(x):
    robots = {"a": ("mir100", (5.5, 4.02, -0.05)), "b": ("ld60", (5.2, 7.4, -1.2))}
    simulation, traffic = lab(robots)
    traffic.navigators["a"].stationary = True
    traffic.send("b", (x, 4.0, 0.0))
    assert not traffic.run(6)
    traffic.navigators["a"].stationary = False

    assert all_arrive(simulation, traffic, 30)


def test_a_stationary_robot_in_a_doorway_stays_and_the_other_takes_the_other_door():
    robots = {"a": ("mir100", (7.0, 3.2, 0.0)), "b": ("fetch", (10.0, 3.2, 1.57))}
    simulation, traffic = lab(robots)
    traffic.navigators["b"].stationary = True
    traffic.send("a", (13.5, 3.2, 0.0))

    assert all_arrive(simulation, traffic, 60)
    assert simulation.poses["b"][:2] == pytest.approx((10.0, 3.2))


def test_one_robot_enters_a_cell_that_two_want_to_leave():
    robots = {
        "a": ("mir100", (17.0, 1.5, 0.0)),
        "b": ("ld60", (18.9, 1.5, 0.0)),
        "c": ("fetch", (17.8, 6.0, 0.0)),
    }
    simulation, traffic = lab(robots)
    traffic.send("c", (17.8, 1.6, -1.57))
    traffic.send("a", (13.0, 3.0, 0.0))
    traffic.send("b", (14.0, 9.0, 0.0))

    assert all_arrive(simulation, traffic, 90)


@pytest.mark.parametrize("oldest", ["a", "c"])
def test_three_robots_in_a_corridor_too_narrow_to_pass_all_arrive(tmp_path, oldest):
    robots = {
        "a": ("mir100", (8.0, 3.0, 0.0)),
        "b": ("ld60", (10.0, 3.0, 0.0)),
        "c": ("fetch", (16.0, 3.0, 3.14)),
    }
    simulation, traffic = corridor(tmp_path, robots)
    goals = {"a": (21.0, 3.0, 0.0), "b": (21.0, 4.5, 0.0), "c": (3.0, 3.0, 0.0)}
    for name in sorted(goals, key=lambda name: (name != oldest, name)):
        traffic.send(name, goals[name])
        traffic.step()

    assert all_arrive(simulation, traffic, 150)


def test_queues_that_meet_in_a_corridor_all_arrive(tmp_path):
    robots = {
        "a": ("mir100", (8.0, 3.0, 0.0)),
        "b": ("ld60", (9.8, 3.0, 0.0)),
        "c": ("fetch", (13.0, 3.0, 3.14)),
        "d": ("youbot", (15.0, 3.0, 3.14)),
    }
    simulation, traffic = corridor(tmp_path, robots)
    goals = {"a": (21, 3, 0.0), "c": (3, 3, 0.0), "b": (21, 4.5, 0.0), "d": (3, 4.5, 0.0)}
    for name, goal in goals.items():
        traffic.send(name, goal)
        traffic.step()

    assert all_arrive(simulation, traffic, 200)


def test_two_robots_that_cannot_hear_each_other_stop_before_they_touch():
    robots = {"a": ("mir100", (2.0, 5.0, 0.0)), "b": ("ld60", (9.3, 5.0, 3.14))}
    simulation, traffic = lab(robots)
    traffic.deaf |= {"a", "b"}
    traffic.send("a", (9.0, 5.0, 0.0))
    traffic.send("b", (2.0, 5.0, 3.14))
    traffic.run(30)

    assert simulation.collisions == 0


def test_an_obstacle_in_the_only_door_aborts_the_goal_and_is_located():
    simulation, traffic = lab({"a": ("mir100", (17.8, 1.6, 0.0))})
    simulation.add_robot("thing", load_model("fetch"), (17.8, 4.3, 1.57))
    traffic.send("a", (13.5, 3.2, 0.0))

    assert traffic.run(90)
    assert not traffic.outcomes["a"].reached
    assert (
        "an obstacle that is not on the map blocks the path at (17." in traffic.outcomes["a"].text
    )
    assert simulation.collisions == 0


def test_four_robots_with_random_goals_reach_them_all_and_touch_nothing():
    simulation, traffic = lab(LAB)
    random = np.random.default_rng(5)
    field = ClearanceField.of(load_map("lab"))
    reached = 0
    while simulation.time < 150.0:
        for name, navigator in traffic.navigators.items():
            if navigator.goal is None:
                assert name not in traffic.outcomes or traffic.outcomes[name].reached
                reached += name in traffic.outcomes
                traffic.send(name, free_pose(random, field))
        traffic.step()

    assert simulation.collisions == 0
    assert reached >= 20


def test_four_robots_whose_processes_are_held_up_again_and_again_touch_nothing():
    simulation, traffic = lab(LAB)
    random = np.random.default_rng(5)
    field = ClearanceField.of(load_map("lab"))
    goes_on = dict.fromkeys(LAB, 0.0)
    while simulation.time < 120.0:
        for name, navigator in traffic.navigators.items():
            if navigator.goal is None:
                traffic.send(name, free_pose(random, field))
            if name not in traffic.held_up and random.random() < 0.01:
                goes_on[name] = simulation.time + random.uniform(0.3, 1.5)
        traffic.held_up = {name for name, until in goes_on.items() if simulation.time < until}
        traffic.step()

    assert simulation.collisions == 0


def test_a_robot_that_was_held_up_starts_slowly_again():
    simulation, traffic = lab({"robot1": LAB["robot1"]})
    navigator = traffic.navigators["robot1"]
    traffic.send("robot1", (12.0, 3.0, 0.0))

    def drive():
        pose = Pose(*simulation.poses["robot1"])
        velocity = navigator.tick(
            simulation.time,
            pose,
            traffic.scan_of("robot1", simulation.scan("robot1")),
            Neighbourhood(),
        ).velocity
        simulation.set_command("robot1", *velocity)
        return velocity.vx

    while (speed := drive()) < 0.8 and simulation.time < 30.0:
        simulation.step(0.1)
    held_up_since = simulation.time
    while simulation.time <= held_up_since + MAX_ROUND:
        simulation.step(0.1)

    assert speed >= 0.8
    assert 0.0 < drive() <= load_model("mir100").base.acceleration * MAX_ROUND


def free_pose(random, field):
    """Return a random pose at which every model can stand."""
    while True:
        x, y, yaw = random.uniform((0.5, 0.5, -3.1), (19.5, 11.5, 3.1))
        if field.at(x, y) >= 0.6:
            return x, y, yaw
