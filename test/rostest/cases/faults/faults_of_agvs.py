# SPDX-License-Identifier: BSD-3-Clause
"""A task of an AGV is done once, whoever dies meanwhile; no AGV is ever given two orders.

The cases run in this order: the last ones leave the hive without a blackboard node and AGVs.
"""

import os
import signal

import psutil
import pytest
import rospy
from blackboard.msg import RobotStatus, TaskMsg, TaskState
from hive_operator import Operator, slow_motion, task
from launching import kill

from vda5050.errors import MessageError
from vda5050.mqtt.link import BrokerSettings, Link
from vda5050.protocol.codec import decode
from vda5050.protocol.topics import Topic, parse_topic
from vda5050.protocol.versions import Version

AGVS = ("agv1", "agv2")
ROBOTS = ("robot1", *AGVS)
SPEED = 0.5
"""Simulated time per real time until an AGV at work is hit: it tells its state once a second."""
SECOND_ORDER = {"OTHER_ORDER_ACTIVE", "orderError"}
"""What an AGV says of an order that comes before the last one is done."""


@pytest.fixture(scope="module")
def operator():
    """The operator's program, once everybody was heard."""
    rospy.init_node("operator")
    operator = Operator(robots=ROBOTS)
    operator.expect(
        lambda: set(ROBOTS) <= set(operator.robots) and operator.heartbeat,
        f"a status of {', '.join(ROBOTS)}",
        lambda: sorted(operator.robots),
    )
    return operator


@pytest.fixture(scope="module")
def broker(operator):
    """The settings of the fleet's broker."""
    assert operator.heartbeat
    return BrokerSettings(port=rospy.get_param("/vda5050_agent/broker/port"))


@pytest.fixture(scope="module", autouse=True)
def errors(broker):
    """What AGVs have said is wrong."""
    said = set()

    def hear(name, payload):
        version = Version.V3_0 if parse_topic(name)[0].major == "v3" else Version.V2_1
        try:
            state = decode(payload, Topic.STATE, version).body
        except MessageError as error:
            said.add(str(error))
            return
        said.update(error.error_type for error in state.errors)

    link = Link(broker, "watcher", hear)
    link.subscribe(["+/+/+/+/state"])
    link.start()
    yield said
    link.stop()


def begun(operator, name, *goals):
    """Post a task that only AGVs are there for; return once one of them drives for it."""
    operator.set_state("robot1", "defect", RobotStatus.DEFECT)
    operator.post(task(name, TaskMsg.GAB, *goals, payload=10.0))
    robot = operator.until(name, TaskState.STARTED).robot_id
    assert robot in AGVS
    operator.set_state("robot1", "idle", RobotStatus.IDLE)
    known = len(operator.tracks[robot])
    operator.expect(
        lambda: any(
            abs(x - operator.tracks[robot][known - 1][1]) > 0.3
            or abs(y - operator.tracks[robot][known - 1][2]) > 0.3
            for _, x, y in operator.tracks[robot][known:]
        ),
        f"{robot} on its way",
    )
    return robot


def done_once(operator, name):
    """Wait for the end of a task; return who did it."""
    end = operator.follow(name)
    assert end.state == TaskState.DONE, operator.told(name)
    finishers = {u.robot_id for u in operator.updates[name] if u.state == TaskState.DONE}
    assert finishers == {end.robot_id}
    return end.robot_id


def test_a_task_of_an_agv_is_done_though_the_broker_dies(operator, broker, errors):
    command = ["-p", str(broker.port)]
    [process] = [p for p in psutil.process_iter(["cmdline"]) if p.info["cmdline"][1:] == command]
    with slow_motion(SPEED):
        begun(operator, "B1", (14.0, 5.4, 0.0), (17.0, 5.6, 0.0))
        os.kill(process.pid, signal.SIGKILL)

    done_once(operator, "B1")  # by another robot, if the broker takes long to come back
    assert not errors & SECOND_ORDER


def test_a_task_of_an_agv_is_done_though_the_agent_dies(operator, errors):
    with slow_motion(SPEED):
        begun(operator, "A1", (14.0, 9.6, 0.0), (16.0, 9.6, 0.0))
        kill("/vda5050_agent")

    done_once(operator, "A1")
    assert not errors & SECOND_ORDER


def test_a_task_of_an_agv_is_done_though_the_blackboard_dies(operator, errors):
    operator.hear_again(*AGVS)
    with slow_motion(SPEED):
        robot = begun(operator, "C1", (14.0, 5.4, 0.0), (12.0, 3.0, 0.0))
        kill("/blackboard")

    assert done_once(operator, "C1") == robot
    assert operator.collisions == 0
    assert not errors & SECOND_ORDER


def test_a_task_of_an_agv_that_dies_is_done_by_another_robot(operator, errors):
    """The other robot's way must not lead over the base of the dead AGV, which it claims."""
    operator.hear_again(*ROBOTS)
    at_home = task("D0", TaskMsg.GA, (2.6, 4.0, 0.0))
    for agv in AGVS:
        operator.set_state(agv, "defect", RobotStatus.DEFECT)
    operator.post(at_home)
    assert done_once(operator, "D0") == "robot1"
    operator.set_state("agv2", "idle", RobotStatus.IDLE)
    operator.set_state("robot1", "defect", RobotStatus.DEFECT)
    operator.post(task("D1", TaskMsg.GA, (17.0, 5.6, 0.0)))
    assert done_once(operator, "D1") == "agv2"

    with slow_motion(SPEED):
        assert begun(operator, "D2", (2.6, 8.0, 0.0), (2.6, 4.0, 0.0)) == "agv2"
        kill("/simulated_agv")
    assert done_once(operator, "D2") == "robot1"
    assert operator.robots["agv2"].state == RobotStatus.OFFLINE
    assert operator.collisions == 0
    assert not errors & SECOND_ORDER
