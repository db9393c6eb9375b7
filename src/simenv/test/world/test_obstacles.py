# SPDX-License-Identifier: BSD-3-Clause
"""People, doors, things in the way, bumpers, faults of wheels and grips, and starting anew."""

import math
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import box

from hive_common.pose import Pose
from robot_description.models import load_model
from simenv.bodies.pick import Act, Order, PickOutcome
from simenv.errors import CommandError, ObstacleError, SpawnError
from simenv.noise import NO_NOISE, Noise
from simenv.simulation import STEP, Simulation
from simenv.testing import hall
from simenv.world.shapes import Door
from simenv.world.world_content import Person

MIR = load_model("mir100")
FETCH = load_model("fetch")
AHEAD = 360
HALF_LENGTH = 0.445
DOOR = Door("the door", box(7.0, 0.5, 7.1, 9.5), "doors", 1.4, open=True)


def simulation(people=(), doors=(), seed=0, noise=NO_NOISE, **more):
    world = replace(hall(), people=tuple(people), doors=tuple(doors))
    return Simulation(world, seed=seed, noise=noise, **more)


def drive(run, seconds, vx=0.0, name="robot1"):
    for _ in range(round(seconds / STEP)):
        run.set_command(name, vx=vx)
        run.step()


def test_a_person_walks_the_route_round_and_round():
    run = simulation([Person("ann", ((2.0, 2.0), (5.0, 2.0), (5.0, 6.0)), speed=1.0)])

    where = []
    for _ in range(13):
        where.append(run.obstacles.people["ann"])
        for _ in range(40):
            run.step()

    assert where[3] == pytest.approx((5.0, 2.0), abs=0.05)
    assert where[7] == pytest.approx((5.0, 6.0), abs=0.05)
    assert where[12] == pytest.approx((2.0, 2.0), abs=0.05)


def test_the_laser_sees_a_person_where_they_are():
    run = simulation([Person("ann", ((7.0, 5.0), (7.0, 8.0)), speed=0.5, radius=0.25)])
    run.add_robot("robot1", MIR, Pose(5.0, 5.0, 0.0))

    seen = run.scan("robot1")[AHEAD]
    for _ in range(80):
        run.step()

    assert seen == pytest.approx(2.0 - 0.25, abs=0.02)
    assert math.isinf(run.scan("robot1")[AHEAD])


def test_a_person_waits_for_a_robot_and_walks_on_when_it_is_gone():
    run = simulation([Person("ann", ((3.0, 5.0), (8.0, 5.0)), speed=1.0)])
    run.add_robot("robot1", MIR, Pose(6.0, 5.0, 0.0))
    drive(run, 5.0)
    waiting = run.obstacles.people["ann"]

    assert 4.0 < waiting[0] < 6.0 - HALF_LENGTH
    assert run.collisions == 0
    run.remove_robot("robot1")
    for _ in range(80):
        run.step()
    assert run.obstacles.people["ann"][0] > waiting[0] + 0.5


def test_a_robot_that_drives_into_a_person_stops_and_it_is_counted_with_the_name():
    run = simulation([Person("ann", ((6.0, 5.0), (6.0, 5.001)), speed=0.001)])
    run.add_robot("robot1", MIR, Pose(4.0, 5.0, 0.0))
    drive(run, 5.0, vx=1.0)

    assert run.collisions == 1
    assert str(run.contacts[0]).startswith("robot1 ran into ann")
    assert run.bumper("robot1") == ("ann",)


def test_the_bumper_tells_of_a_wall_until_the_robot_has_backed_off():
    run = simulation()
    run.add_robot("robot1", MIR, Pose(8.5, 5.0, 0.0))
    assert run.bumper("robot1") == ()
    drive(run, 3.0, vx=1.0)
    assert run.bumper("robot1") == ("",)

    drive(run, 1.0, vx=-0.5)

    assert run.bumper("robot1") == ()


def test_a_shut_door_stops_robots_and_beams_and_an_open_one_does_not():
    run = simulation(doors=[DOOR])
    run.add_robot("robot1", MIR, Pose(5.0, 5.0, 0.0))
    assert math.isinf(run.scan("robot1")[AHEAD])

    run.set_door("the door", is_open=False)
    drive(run, 4.0, vx=1.0)

    assert run.poses["robot1"].x == pytest.approx(7.0 - HALF_LENGTH, abs=0.01)
    assert run.scan("robot1")[AHEAD] == pytest.approx(HALF_LENGTH, abs=0.01)
    assert run.obstacles.shut == {"the door"}
    run.set_door("the door", is_open=True)
    drive(run, 2.0, vx=1.0)
    assert run.poses["robot1"].x > 7.5


def test_a_door_is_not_shut_on_a_robot_and_an_unknown_one_is_named():
    run = simulation(doors=[DOOR])
    run.add_robot("robot1", MIR, Pose(7.0, 5.0, 0.0))

    with pytest.raises(ObstacleError, match="robot1 stands there"):
        run.set_door("the door", is_open=False)
    with pytest.raises(ObstacleError, match="'gate': not known; in this world: the door"):
        run.set_door("gate", is_open=False)


def test_something_put_in_the_way_blocks_until_it_is_taken_away():
    run = simulation()
    run.add_robot("robot1", MIR, Pose(5.0, 5.0, 0.0))
    run.block("crate", box(6.0, 4.0, 7.0, 6.0))

    assert run.scan("robot1")[AHEAD] == pytest.approx(1.0)
    with pytest.raises(SpawnError, match="'crate' is there"):
        run.add_robot("robot2", MIR, Pose(6.0, 4.0, 0.0))
    run.obstacles.take("crate")
    assert math.isinf(run.scan("robot1")[AHEAD])
    with pytest.raises(ObstacleError, match="put down so far: nothing"):
        run.obstacles.take("crate")


def test_slipping_wheels_turn_but_the_robot_hardly_moves():
    run = simulation()
    run.add_robot("robot1", MIR, Pose(3.0, 5.0, 0.0))
    run.set_slip("robot1", 0.9)

    drive(run, 3.0, vx=0.5)

    really, felt = run.poses["robot1"].x - 3.0, run.odometry("robot1").x
    assert really == pytest.approx(0.1 * felt)
    with pytest.raises(CommandError, match="from 0 to 1"):
        run.set_slip("robot1", 1.5)


def pick(run):
    """Have the arm pick once; return how it ended."""
    arm = run.arm("robot1")
    arm.start(Order(Act.PICK, "T1", 1.0), run.poses["robot1"])
    while arm.busy:
        run.step()
    return arm.result.outcome


def test_a_grip_fails_at_will_and_the_next_one_does_not():
    run = simulation()
    run.add_robot("robot1", FETCH, Pose(5.0, 5.0, 0.0))
    run.arm("robot1").fail_next = 1

    assert pick(run) is PickOutcome.DROPPED
    assert run.arm("robot1").load is None
    assert pick(run) is PickOutcome.SUCCESS


def test_grips_fail_as_often_as_is_wished_and_the_same_ones_with_the_same_seed():
    runs = []
    for _ in range(2):
        run = simulation(pick_failures=0.5, seed=3)
        run.add_robot("robot1", FETCH, Pose(5.0, 5.0, 0.0))
        runs.append([pick(run) for _ in range(12)])

    assert runs[0] == runs[1]
    assert 2 <= runs[0].count(PickOutcome.DROPPED) <= 10


def test_reset_puts_everything_back_and_lets_time_go_on():
    run = simulation([Person("ann", ((2.0, 2.0), (2.0, 8.0)))], [DOOR])
    run.add_robot("robot1", FETCH, Pose(5.0, 5.0, 0.0))
    pick(run)
    drive(run, 5.0, vx=1.0)
    run.set_door("the door", is_open=True)
    run.block("crate", box(1.0, 1.0, 1.5, 1.5))
    before = run.time

    run.reset()

    assert run.poses["robot1"] == (5.0, 5.0, 0.0)
    assert run.odometry("robot1") == (0.0, 0.0, 0.0)
    assert run.velocity("robot1") == (0.0, 0.0, 0.0)
    assert run.arm("robot1").load is None
    assert run.obstacles.people["ann"] == (2.0, 2.0)
    assert run.obstacles.shut == frozenset()
    assert run.collisions == 0
    assert run.time == before


def test_the_same_seed_gives_the_same_run_to_the_last_bit_with_everything_in_it():
    records = []
    for _ in range(2):
        people = [Person("ann", ((2.0, 2.0), (8.0, 2.0), (8.0, 8.0)))]
        run = simulation(people, [DOOR], seed=11, noise=Noise(), pick_failures=0.3)
        run.add_robot("robot1", MIR, Pose(3.0, 5.0, 0.3))
        run.add_robot("robot2", FETCH, Pose(3.0, 7.0, -0.3))
        record = []
        for step in range(400):
            run.set_command("robot1", vx=0.8, wz=0.2 * math.sin(step / 20))
            run.set_command("robot2", vx=0.6, wz=-0.3)
            if step == 100:
                run.set_door("the door", is_open=False)
            run.step()
            if step % 4 == 0:
                record += [run.scan(name).tobytes() for name in run.names]
                record += [run.odometry(name) for name in run.names]
        record.append((run.poses, run.contacts, run.obstacles.people))
        records.append(record)

    assert records[0] == records[1]


def test_odometry_drifts_more_the_farther_a_robot_drives_and_not_at_all_without_noise():
    def error(noise, seed, seconds):
        run = simulation(seed=seed, noise=noise)
        run.add_robot("robot1", MIR, Pose(5.0, 5.0, 0.0))
        for _ in range(round(seconds / STEP)):
            run.set_command("robot1", vx=0.5, wz=0.5)
            run.step()
        truth, felt = run.poses["robot1"], run.odometry("robot1")
        return math.dist(felt[:2], (truth.x - 5.0, truth.y - 5.0))

    short, long = (np.mean([error(Noise(), s, t) for s in range(8)]) for t in (5.0, 60.0))

    assert error(NO_NOISE, 1, 20.0) < 1e-9
    assert 0 < short < long


def test_noise_of_one_kind_leaves_the_others_alone():
    only_wheels = replace(NO_NOISE, wheels=0.02)
    run = simulation(noise=only_wheels)
    run.add_robot("robot1", MIR, Pose(2.0, 5.0, 0.0))
    drive(run, 4.0, vx=0.5)

    really, felt = run.poses["robot1"].x - 2.0, run.odometry("robot1").x

    assert 0.001 < abs(felt / really - 1) < 0.1
    assert run.odometry("robot1").yaw == 0.0


def test_noise_is_scaled_as_a_whole():
    assert Noise().times(0.0) == NO_NOISE
    assert Noise().times(2.0).laser == 2 * Noise().laser
