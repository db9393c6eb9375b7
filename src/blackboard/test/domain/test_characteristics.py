# SPDX-License-Identifier: BSD-3-Clause
"""What a robot is, read from its description."""

import copy
from dataclasses import replace

import pytest

from blackboard.domain.characteristics import RobotState, RobotStatus, characteristics_from
from blackboard.domain.task import Task, TaskType
from blackboard.errors import CharacteristicsError
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT

MODEL = {
    "name": "carrier",
    "base": {
        "mass": 70.0,
        "max_speed": 1.5,
        "friction_coefficient": 0.02,
        "footprint": [[-0.4, -0.3], [0.5, -0.3], [0.5, 0.3], [-0.4, 0.3]],
    },
    "payload": 100.0,
    "battery": {
        "capacity": 40.0,
        "voltage_full": 29.4,
        "voltage_empty": 21.0,
        "charging_time": 10800.0,
        "idle_power": 50.0,
    },
    "arm": {"payload": 6.0, "power": 120.0, "pick_duration": 8.0, "place_duration": 6.0},
    "capabilities": ["GA", "GPAB"],
}
A, B = Pose(1.0, 1.0), Pose(2.0, 1.0)


def changed(*keys, value=None):
    """Return the model with one value set, or left out where None is given."""
    model = copy.deepcopy(MODEL)
    part = model
    for key in keys[:-1]:
        part = part[key]
    if value is None:
        del part[keys[-1]]
    else:
        part[keys[-1]] = value
    return model


def test_everything_that_bidding_needs_is_read_from_the_model():
    robot = characteristics_from(MODEL)

    assert (robot.mass, robot.payload, robot.max_speed) == (70.0, 100.0, 1.5)
    assert (robot.friction_coefficient, robot.idle_power) == (0.02, 50.0)
    assert (robot.arm_payload, robot.arm_power) == (6.0, 120.0)
    assert (robot.pick_duration, robot.place_duration) == (8.0, 6.0)
    assert robot.battery.capacity == 40.0
    assert robot.capabilities == {TaskType.GA, TaskType.GPAB}


def test_the_radius_is_the_distance_from_the_base_to_the_nearest_edge():
    assert characteristics_from(MODEL).radius == pytest.approx(0.3)


def test_a_model_without_an_arm_lifts_nothing():
    robot = characteristics_from(changed("arm"))

    assert (robot.arm_payload, robot.arm_power, robot.pick_duration) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("keys", "value", "named"),
    [
        (("payload",), None, "payload: missing"),
        (("base", "mass"), None, "base.mass: missing"),
        (("battery", "capacity"), None, "battery.capacity: missing"),
        (("capabilities",), ["GA", "FLY"], "capabilities[1]: 'FLY'; allowed: GA"),
        (("base", "footprint"), [[0.4, 0.3]] * 4, "counter-clockwise around the middle"),
        (("base", "footprint"), [], "counter-clockwise around the middle"),
        (("base", "mass"), 1e9, "base.mass: 1000000000.0; allowed: a number, above 0"),
        (("base", "mass"), -1.0, "base.mass: -1.0; allowed: a number, above 0"),
        (("payload",), -1.0, "payload: -1.0; allowed: a number, 0"),
        (("base", "max_speed"), float("inf"), "base.max_speed: inf"),
        (("arm", "power"), float("nan"), "arm.power: nan"),
        (("battery", "voltage_full"), 20.0, "voltage_full is 20.0"),
        (("base", "mass"), "heavy", "base.mass: 'heavy'; allowed: a number, above 0"),
        (("base",), 7, "base: 7; allowed: the keys mass, "),
        (("base", "footprint"), [[0.0], [1.0, 2.0]], "base.footprint[0]: [0.0]"),
        (("battery", "capacity"), "big", "battery.capacity: 'big'"),
    ],
)
def test_a_model_that_no_robot_can_have_is_refused_by_the_name_of_the_value(keys, value, named):
    with pytest.raises(CharacteristicsError) as refused:
        characteristics_from(changed(*keys, value=value))

    assert named in str(refused.value)


@pytest.mark.parametrize(
    ("task", "words"),
    [
        (Task("T", TaskType.GPA, (A,)), "does not do GPA"),
        (Task("T", TaskType.GA, (A,), payload=100.5), "carries at most 100 kg, not 100.5 kg"),
        (Task("T", TaskType.GPAB, (A, B), payload=7.0), "its arm lifts at most 6 kg, not 7 kg"),
        (Task("T", TaskType.GPAB, (A, B), payload=6.0), ""),
        (Task("T", TaskType.GA, (A,), payload=100.0), ""),
    ],
)
def test_a_robot_says_why_it_can_never_do_a_task(task, words):
    assert characteristics_from(MODEL).excludes(task) == words


@pytest.mark.parametrize("name", ["mass", "max_speed", "friction_coefficient", "radius"])
def test_what_has_to_be_above_nothing_is_not_nothing(name):
    with pytest.raises(CharacteristicsError, match=f"{name} is 0; allowed: above 0"):
        replace(SMALL_ROBOT, **{name: 0})


def test_a_robot_is_in_service_when_it_is_idle_or_busy():
    assert {state for state in RobotState if state.in_service} == {
        RobotState.IDLE,
        RobotState.BUSY,
    }


def test_what_a_robot_carries_is_told_for_each_type_of_task():
    robot = characteristics_from(MODEL)

    assert robot.carries == (100.0, -1.0, -1.0, 6.0)
    assert characteristics_from(changed("arm")).carries == (100.0, -1.0, -1.0, 0.0)


@pytest.mark.parametrize(
    ("carries", "most"), [((100.0, -1.0, -1.0, 6.0), 6.0), ((), None), ((100.0,), None)]
)
def test_a_status_that_does_not_tell_what_a_robot_carries_is_unknown(carries, most):
    status = RobotStatus("robot1", RobotState.IDLE, A, 1.0, carries=carries)

    assert status.most_payload(TaskType.GPAB) == most
