# SPDX-License-Identifier: BSD-3-Clause
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from shapely.geometry import Polygon, box

from hive_common.geometry import Footprint
from hive_common.pose import Pose
from robot_description.models import load_model
from simenv.errors import CommandError, SpawnError, UnknownRobotError
from simenv.noise import NO_NOISE, Noise
from simenv.simulation import STEP, Simulation
from simenv.testing import crowd, hall
from simenv.world.shapes import Shape

MIR = load_model("mir100")
LD = load_model("ld60")
YOUBOT = load_model("youbot")
HALF_LENGTH = 0.445  # of the mir100 [m]


def drive(simulation, seconds, **commands):
    """Let time pass, with a command (vx, vy, wz) for each robot named, given every step."""
    for _ in range(round(seconds / STEP)):
        for name, command in commands.items():
            simulation.set_command(name, *command)
        simulation.step()


def quiet(*shapes):
    return Simulation(hall(*shapes), noise=NO_NOISE)


def test_a_robot_drives_as_far_as_its_speed_says():
    simulation = quiet()
    simulation.add_robot("robot1", MIR, Pose(2.0, 5.0, 0.0))

    drive(simulation, 4.0, robot1=(0.5, 0.0, 0.0))

    lost_speeding_up = 0.5**2 / (2 * MIR.base.acceleration)
    assert simulation.poses["robot1"].x == pytest.approx(2.0 + 2.0 - lost_speeding_up, abs=0.02)
    assert simulation.poses["robot1"].y == 5.0
    assert simulation.time == pytest.approx(4.0)


def test_a_robot_that_is_told_nothing_for_half_a_second_stops():
    simulation = quiet()
    simulation.add_robot("robot1", MIR, Pose(2.0, 5.0, 0.0))
    drive(simulation, 2.0, robot1=(0.5, 0.0, 0.0))

    drive(simulation, 0.45)
    assert simulation.velocity("robot1")[0] == pytest.approx(0.5)
    drive(simulation, 0.1 + 0.5 / MIR.base.acceleration)

    assert simulation.velocity("robot1") == (0.0, 0.0, 0.0)


def test_a_robot_stops_at_the_wall_and_it_is_counted_once_however_long_it_pushes():
    simulation = quiet()
    simulation.add_robot("robot1", MIR, Pose(8.0, 5.0, 0.0))

    drive(simulation, 6.0, robot1=(1.0, 0.0, 0.0))

    assert simulation.collisions == 1
    assert simulation.poses["robot1"].x == pytest.approx(9.5 - HALF_LENGTH, abs=1e-3)
    assert simulation.poses["robot1"].x <= 9.5 - HALF_LENGTH


def test_stopping_and_pushing_again_is_still_the_same_contact():
    simulation = quiet()
    simulation.add_robot("robot1", MIR, Pose(8.5, 5.0, 0.0))
    drive(simulation, 3.0, robot1=(1.0, 0.0, 0.0))
    drive(simulation, 2.0)
    drive(simulation, 1.0, robot1=(1.0, 0.0, 0.0))

    assert simulation.collisions == 1


def test_backing_off_and_hitting_the_wall_again_counts_again():
    simulation = quiet()
    simulation.add_robot("robot1", MIR, Pose(8.5, 5.0, 0.0))
    drive(simulation, 3.0, robot1=(1.0, 0.0, 0.0))
    drive(simulation, 1.0, robot1=(-0.5, 0.0, 0.0))
    drive(simulation, 3.0, robot1=(1.0, 0.0, 0.0))

    assert simulation.collisions == 2


def test_a_robot_turns_its_corner_into_a_wall():
    simulation = quiet()
    simulation.add_robot("robot1", MIR, Pose(5.0, 0.5 + 0.3, 0.0))

    drive(simulation, 3.0, robot1=(0.0, 0.0, 0.5))

    corners = Footprint(MIR.base.footprint).at(simulation.poses["robot1"])
    (contact,) = simulation.contacts
    assert str(contact).startswith("robot1 ran into a wall at (5.00, 0.80)")
    assert corners[:, 1].min() == pytest.approx(0.5, abs=2e-3)


def test_two_robots_that_meet_stop_and_are_counted_once():
    simulation = quiet()
    simulation.add_robot("robot1", MIR, Pose(3.0, 5.0, 0.0))
    simulation.add_robot("robot2", MIR, Pose(7.0, 5.0, math.pi))

    drive(simulation, 6.0, robot1=(0.8, 0.0, 0.0), robot2=(0.8, 0.0, 0.0))

    gap = simulation.poses["robot2"].x - simulation.poses["robot1"].x - 2 * HALF_LENGTH
    assert simulation.collisions == 1
    assert str(simulation.contacts[0]).startswith(
        ("robot1 ran into robot2", "robot2 ran into robot1")
    )
    assert 0.0 <= gap < 5e-3


def test_a_robot_drives_away_from_one_that_ran_into_it():
    simulation = quiet()
    simulation.add_robot("robot1", MIR, Pose(3.0, 5.0, 0.0))
    simulation.add_robot("robot2", MIR, Pose(5.0, 5.0, 0.0))
    drive(simulation, 4.0, robot1=(0.8, 0.0, 0.0))
    assert simulation.collisions == 1

    drive(simulation, 3.0, robot2=(0.8, 0.0, 0.0))

    assert simulation.collisions == 1
    assert simulation.poses["robot2"].x > 6.5


def test_whatever_robots_do_they_never_stand_in_each_other_or_in_a_wall():
    table = Shape("table", box(4.0, 4.0, 6.0, 5.0))
    simulation = quiet(table)
    models = {"robot1": MIR, "robot2": LD, "robot3": YOUBOT}
    for index, (name, model) in enumerate(models.items()):
        simulation.add_robot(name, model, Pose(2.0 + 2 * index, 2.5, index))
    random = np.random.default_rng(6)
    for _ in range(60):
        commands = {name: tuple(random.uniform((-0.5, -0.5, -2), 2)) for name in models}
        drive(simulation, 0.4, **commands)
        areas = [
            Polygon(Footprint(model.base.footprint).at(simulation.poses[name])).buffer(-1e-6)
            for name, model in models.items()
        ]

        assert not any(simulation.world.solid.intersects(area) for area in areas)
        assert not any(a.intersects(b) for a in areas for b in areas if a is not b)
    assert simulation.collisions > 3


def test_odometry_starts_at_zero_where_the_robot_was_put_down():
    simulation = quiet()
    simulation.add_robot("robot1", MIR, Pose(5.0, 5.0, math.pi / 2))
    assert simulation.odometry("robot1") == (0.0, 0.0, 0.0)

    drive(simulation, 2.0, robot1=(0.5, 0.0, 0.0))

    odometry = simulation.odometry("robot1")
    assert odometry.x == pytest.approx(simulation.poses["robot1"].y - 5.0)
    assert odometry.y == pytest.approx(0.0, abs=1e-9)


def test_wheels_that_are_stopped_by_a_wall_count_no_further():
    simulation = quiet()
    simulation.add_robot("robot1", MIR, Pose(8.0, 5.0, 0.0))

    drive(simulation, 6.0, robot1=(1.0, 0.0, 0.0))

    assert simulation.odometry("robot1").x == pytest.approx(simulation.poses["robot1"].x - 8.0)


def test_odometry_drifts_with_the_square_root_of_the_way():
    noise = Noise(laser=0.0, distance=0.05, heading=0.0)
    errors = []
    for seed in range(20):
        simulation = Simulation(hall(), seed=seed, noise=noise)
        simulation.add_robot("robot1", MIR, Pose(2.0, 5.0, 0.0))
        drive(simulation, 3.0, robot1=(1.0, 0.0, 0.0))
        way = simulation.poses["robot1"].x - 2.0
        errors.append((simulation.odometry("robot1").x - way) / math.sqrt(way))

    assert np.std(errors) == pytest.approx(0.05, rel=0.3)
    assert abs(np.mean(errors)) < 0.025


def record(seed, *, with_third=False, start=0):
    simulation = Simulation(hall(), seed=seed, start=start)
    simulation.add_robot("robot1", MIR, Pose(2.0, 2.0, 0.0))
    simulation.add_robot("robot2", YOUBOT, Pose(4.0, 4.0, 1.0))
    if with_third:
        simulation.add_robot("robot3", LD, Pose(8.5, 8.5, 1.0))
    taken = []
    for _ in range(10):
        drive(simulation, 0.2, robot1=(0.7, 0.0, 0.2), robot2=(0.3, 0.3, -0.5))
        taken.append(simulation.scan("robot1").tobytes())
        taken.append(np.array(simulation.odometry("robot2")).tobytes())
        taken.append(np.array(simulation.poses["robot1"]).tobytes())
    return taken


def test_the_same_seed_and_commands_give_the_same_run_to_the_last_bit():
    assert record(7) == record(7)


def test_another_seed_gives_another_run():
    assert record(7) != record(8)


def test_a_start_at_a_date_changes_the_time_alone():
    date = 1_800_000_000_000_000_000
    late = Simulation(hall(), start=date)
    drive(late, 0.2)

    assert late.nanoseconds == date + 200_000_000
    assert record(7, start=date) == record(7)


def test_one_robot_more_out_of_sight_changes_nothing_for_the_others():
    assert record(7) == record(7, with_third=True)


def test_two_robots_do_not_make_the_same_errors():
    simulation = Simulation(hall())
    simulation.add_robot("robot1", MIR, Pose(2.0, 3.0, 0.0))
    simulation.add_robot("robot2", MIR, Pose(2.0, 7.0, 0.0))

    drive(simulation, 1.0, robot1=(0.5, 0.0, 0.0), robot2=(0.5, 0.0, 0.0))

    assert simulation.odometry("robot1") != simulation.odometry("robot2")


def test_a_removed_robot_is_out_of_the_way_and_its_name_is_free():
    simulation = quiet()
    simulation.add_robot("robot1", MIR, Pose(3.0, 5.0, 0.0))
    simulation.add_robot("robot2", MIR, Pose(5.0, 5.0, 0.0))
    simulation.remove_robot("robot2")

    drive(simulation, 4.0, robot1=(0.8, 0.0, 0.0))
    simulation.add_robot("robot2", YOUBOT, Pose(1.5, 5.0, 0.0))

    assert simulation.collisions == 0
    assert simulation.names == ("robot1", "robot2")


def test_the_robots_that_stay_keep_their_state_when_one_is_removed():
    simulation = quiet()
    simulation.add_robot("robot1", MIR, Pose(3.0, 3.0, 0.0))
    simulation.add_robot("robot2", LD, Pose(3.0, 7.0, 0.0))
    drive(simulation, 1.0, robot2=(0.6, 0.0, 0.0))
    before = simulation.odometry("robot2"), simulation.velocity("robot2")

    simulation.remove_robot("robot1")

    assert (simulation.odometry("robot2"), simulation.velocity("robot2")) == before
    simulation.step()
    assert simulation.velocity("robot2") == before[1]
    drive(simulation, 1.0, robot2=(9.0, 0.0, 0.0))
    assert simulation.velocity("robot2")[0] == pytest.approx(0.6 + LD.base.acceleration * 1.0)


@pytest.mark.parametrize(
    ("name", "pose", "words"),
    [
        ("robot1", (5.0, 5.0, 0.0), "the name is taken"),
        ("robot 2", (5.0, 5.0, 0.0), "letters, digits and _"),
        ("", (5.0, 5.0, 0.0), "letters, digits and _"),
        ("robot2", (2.3, 2.0, 0.0), "robot1 is there"),
        ("robot2", (0.6, 5.0, 0.0), "'west wall' is there"),
        ("robot2", (4.5, 4.5, 0.0), "'table' is there"),
        ("robot2", (50.0, 5.0, 0.0), "outside the world 'hall'"),
        ("robot2", (math.nan, 5.0, 0.0), "must be numbers"),
    ],
)
def test_a_robot_that_cannot_be_put_down_is_refused_with_the_reason(name, pose, words):
    simulation = quiet(Shape("table", box(4.0, 4.0, 5.0, 5.0)))
    simulation.add_robot("robot1", MIR, Pose(2.0, 2.0, 0.0))

    with pytest.raises(SpawnError, match=words):
        simulation.add_robot(name, MIR, pose)

    assert simulation.names == ("robot1",)


def test_a_robot_that_is_not_there_is_named_with_those_that_are():
    simulation = quiet()
    simulation.add_robot("robot1", MIR, Pose(2.0, 2.0, 0.0))

    with pytest.raises(UnknownRobotError, match="'robot9': not known; in the simulation: robot1"):
        simulation.set_command("robot9", 1.0)


def test_a_speed_that_is_no_number_is_refused_and_changes_nothing():
    simulation = quiet()
    simulation.add_robot("robot1", MIR, Pose(2.0, 2.0, 0.0))

    with pytest.raises(CommandError, match="not a number"):
        simulation.set_command("robot1", math.nan, 0.0, 0.0)

    simulation.step()
    assert simulation.poses["robot1"] == (2.0, 2.0, 0.0)


@pytest.mark.parametrize("dt", [0.0, -0.1, 0.2, math.nan])
def test_a_step_that_is_too_long_or_goes_back_is_refused(dt):
    with pytest.raises(ValueError, match=r"allowed: above 0 and at most 0\.1 s"):
        quiet().step(dt)


def test_a_world_without_robots_lets_time_pass():
    simulation = quiet()
    for _ in range(400):
        simulation.step()

    assert simulation.nanoseconds == 10_000_000_000


@pytest.mark.slow
def test_freshly_compiled_and_cached_code_give_the_same_run_to_the_last_bit(tmp_path):
    code = "from simenv.testing import crowd; print(crowd(seed=4).hex())"
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": ":".join(sys.path)}

    fresh = subprocess.check_output([sys.executable, "-c", code], env=environment, text=True)

    assert list(tmp_path.rglob("*.nbc"))
    assert bytes.fromhex(fresh) == crowd(seed=4) != crowd(seed=5)
