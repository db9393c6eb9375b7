# SPDX-License-Identifier: BSD-3-Clause
"""The follower stays on the path and within its limits, and stops at the end."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from hive_common.pose import STOP, Pose, Velocity
from hive_navigation.control.follower import Room
from hive_navigation.control.pursuit_follower import (
    STRAIGHT,
    PursuitFollower,
    speed_to_stop_within,
)
from hive_navigation.planning.path import Path, angle_between
from robot_description.models import load_model, model_names

DT = 0.1
COMMAND_TIMEOUT = 0.5
CORNER = Path([(0.0, 0.0), (3.0, 0.0), (4.0, 0.6), (4.0, 3.0)])


def moved(pose: Pose, velocity: Velocity) -> Pose:
    """Return where an ideal base is after one round, in small steps."""
    x, y, yaw = pose
    for _ in range(10):
        x += 0.1 * DT * (velocity.vx * math.cos(yaw) - velocity.vy * math.sin(yaw))
        y += 0.1 * DT * (velocity.vx * math.sin(yaw) + velocity.vy * math.cos(yaw))
        yaw += 0.1 * DT * velocity.wz
    return Pose(x, y, yaw)


def driven(model: str, path: Path, yaw: float, room: Room) -> list[tuple[Pose, Velocity]]:
    """Drive along a path for up to 60 s; return poses and commands."""
    follower = PursuitFollower(load_model(model).base)
    follower.start(path, yaw)
    pose, track = Pose(0.0, 0.0, 0.0), [(Pose(0.0, 0.0, 0.0), STOP)]
    while not follower.arrived and len(track) < 600:
        velocity = follower.command(pose, room, DT)
        pose = moved(pose, velocity)
        track.append((pose, velocity))
    return track


@pytest.mark.parametrize("model", model_names())
def test_it_stops_at_the_goal_with_the_wanted_yaw(model: str) -> None:
    pose, velocity = driven(model, CORNER, -2.0, Room())[-1]

    assert math.dist(pose[:2], CORNER.end) < 0.1
    assert abs(angle_between(pose.yaw, -2.0)) < 0.1
    assert max(map(abs, velocity)) < 0.06


@pytest.mark.parametrize("model", model_names())
def test_it_drives_no_faster_than_its_speed_limit(model: str) -> None:
    base = load_model(model).base
    follower = PursuitFollower(base)
    follower.speed_limit = base.max_speed / 2
    follower.start(Path([(0.0, 0.0), (4.0, 0.0)]), None)
    pose, fastest = Pose(0.0, 0.0, 0.0), 0.0
    for _ in range(100):
        velocity = follower.command(pose, Room(), DT)
        pose, fastest = moved(pose, velocity), max(fastest, math.hypot(*velocity[:2]))

    assert fastest == pytest.approx(base.max_speed / 2, rel=0.05)


@pytest.mark.parametrize("model", model_names())
def test_it_stays_near_the_path(model: str) -> None:
    for pose, _ in driven(model, CORNER, 0.0, Room()):
        here = pose[:2]

        assert math.dist(CORNER.at(CORNER.nearest(here, 0.0, 99.0)), here) < 0.1


def test_a_slight_bend_costs_no_time() -> None:
    straight = Path([(0.0, 0.0), (8.0, 0.0)])
    bent = Path([(0.0, 0.0), (4.0, 0.0), (8.0, 4.0 * math.tan(math.radians(3.0)))])

    rounds = [len(driven("ld60", path, 0.0, Room(3.0))) for path in (straight, bent)]

    assert (rounds[1] - rounds[0]) * DT <= 0.2


@pytest.mark.parametrize("model", model_names())
def test_it_knows_how_long_a_quarter_turn_takes(model: str) -> None:
    poses = [pose for pose, _ in driven(model, Path([(0.0, 0.0)]), math.pi / 2, Room())]
    turned = next(index for index, pose in enumerate(poses) if pose.yaw > math.pi / 2 - STRAIGHT)
    rate = PursuitFollower(load_model(model).base).limits(3.0).yaw_rate

    assert turned * DT == pytest.approx(math.pi / 2 / rate, abs=0.4)


@pytest.mark.parametrize("model", model_names())
def test_it_keeps_to_the_limits_of_its_base(model: str) -> None:
    base = load_model(model).base
    track = driven(model, CORNER, 3.0, Room())

    for (_, before), (_, after) in pairwise(track):
        assert math.hypot(after.vx, after.vy) <= base.max_speed + 1e-6
        assert abs(after.wz) <= base.max_yaw_rate + 1e-6
        assert math.dist(before[:2], after[:2]) <= base.acceleration * DT + 1e-6
        assert abs(after.wz - before.wz) <= base.yaw_acceleration * DT + 1e-6


def test_only_a_holonomic_base_is_commanded_sideways() -> None:
    path = Path([(0.0, 0.0), (0.0, 2.0)])

    assert all(velocity.vy == 0 for _, velocity in driven("mir100", path, 0.0, Room()))
    assert any(abs(velocity.vy) > 0.2 for _, velocity in driven("youbot", path, 0.0, Room()))


@pytest.mark.parametrize("model", model_names())
def test_it_stops_within_the_room_it_has(model: str) -> None:
    path = Path([(0.0, 0.0), (9.0, 0.0)])
    follower = PursuitFollower(load_model(model).base)
    follower.start(path, 0.0)
    pose = Pose(0.0, 0.0, 0.0)
    for _ in range(200):
        pose = moved(pose, follower.command(pose, Room(max(0.0, 3.0 - pose.x)), DT))

    assert 2.7 < pose.x <= 3.0


@pytest.mark.parametrize("model", model_names())
def test_a_base_that_gets_no_more_commands_stops_within_the_room_it_had(model: str) -> None:
    base = load_model(model).base
    follower = PursuitFollower(base)
    follower.start(Path([(0.0, 0.0), (9.0, 0.0)]), 0.0)
    pose, last, ends = Pose(0.0, 0.0, 0.0), STOP, []
    while pose.x < 2.5:
        last = follower.command(pose, Room(3.0 - pose.x), DT)
        pose = moved(pose, last)
        ends.append(pose.x + last.vx * COMMAND_TIMEOUT + last.vx**2 / (2 * base.acceleration))

    assert max(ends) <= 3.05


def test_a_base_that_has_stopped_by_itself_starts_slowly() -> None:
    follower = PursuitFollower(load_model("mir100").base)
    follower.start(Path([(0.0, 0.0), (9.0, 0.0)]), 0.0)
    begin = follower.command(Pose(0.0, 0.0, 0.0), Room(), DT)
    for _ in range(10):
        follower.command(Pose(0.0, 0.0, 0.0), Room(), DT)
    follower.stopped()

    assert follower.command(Pose(0.0, 0.0, 0.0), Room(), DT) == begin


def test_it_does_not_turn_without_room_to_turn() -> None:
    follower = PursuitFollower(load_model("mir100").base)
    follower.start(Path([(0.0, 0.0), (-2.0, 0.0)]), 0.0)

    assert follower.command(Pose(0.0, 0.0, 0.0), Room(turn=False), DT) == STOP


def test_the_speed_to_stop_within_a_distance_uses_that_distance_up() -> None:
    speed = speed_to_stop_within(2.0, 0.8, 0.2)

    assert speed * 0.2 + speed**2 / (2 * 0.8) == pytest.approx(2.0)
    assert speed_to_stop_within(-1.0, 0.8, 0.2) == 0.0
