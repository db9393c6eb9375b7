# SPDX-License-Identifier: BSD-3-Clause
"""The operator's contract: fields and constants of the messages, as generated for Python."""

import blackboard.msg as bb_msgs
import pytest
import rospy
from geometry_msgs.msg import Pose2D

from blackboard.domain.task import TaskType
from hive_lab.runner.limits import PATIENCE

# Name and type of the fields that other people's programs use. Further fields may follow them.
FIELDS = {
    "TaskMsg": {
        "header": "std_msgs/Header",
        "id": "string",
        "type": "uint8",
        "priority": "uint8",
        "payload": "float64",
        "goals": "geometry_msgs/Pose2D[]",
        "robot_id": "string",
    },
    "TaskState": {
        "header": "std_msgs/Header",
        "task_id": "string",
        "state": "uint8",
        "robot_id": "string",
        "step": "uint8",
        "steps": "uint8",
        "eta": "float64",
        "epoch": "uint32",
        "reason": "string",
    },
    "TaskCost": {
        "header": "std_msgs/Header",
        "robot_id": "string",
        "task_id": "string",
        "cost": "float64",
        "energy_cost": "float64",
        "eta": "float64",
        "epoch": "uint32",
    },
    "RobotStatus": {
        "header": "std_msgs/Header",
        "robot_id": "string",
        "state": "uint8",
        "pose": "geometry_msgs/Pose2D",
        "charge": "float64",
        "payload": "float64",
        "task_id": "string",
        "queued": "uint16",
        "reason": "string",
    },
    "BbBackup": {
        "header": "std_msgs/Header",
        "epoch": "uint32",
        "active": "string",
        "backup": "string",
        "members": "string[]",
    },
    "BbSynch": {
        "header": "std_msgs/Header",
        "epoch": "uint32",
        "version": "uint32",
        "tasks": "blackboard/TaskRecord[]",
    },
    "TaskRecord": {
        "task": "blackboard/TaskMsg",
        "state": "uint8",
        "robot": "string",
        "step": "uint8",
        "eta": "float64",
        "reason": "string",
        "parent": "string",
    },
}

CONSTANTS = {
    "TaskMsg": {"GA": 0, "GAB": 1, "GPA": 2, "GPAB": 3},
    "TaskState": {
        "WAITING": 0,
        "ASSIGNED": 1,
        "STARTED": 2,
        "DONE": 3,
        "REJECTED": 4,
        "CANCELLED": 5,
        "FAILED": 6,
    },
    "TaskCost": {"MAX_COST": 1000},
    "RobotStatus": {"IDLE": 0, "BUSY": 1, "DEFECT": 2, "CHARGING": 3, "OFFLINE": 4},
}


@pytest.fixture(scope="module", autouse=True)
def node():
    """Make this process a node: stamps need a clock."""
    rospy.init_node("messages")


@pytest.mark.parametrize("name", FIELDS)
def test_a_message_starts_with_the_promised_fields(name):
    message = getattr(bb_msgs, name)
    types = message._slot_types  # noqa: SLF001  (genpy offers them under no other name)
    fields = list(zip(message.__slots__, types, strict=True))

    assert fields[: len(FIELDS[name])] == list(FIELDS[name].items())


@pytest.mark.parametrize("name", CONSTANTS)
def test_a_message_has_the_promised_constants(name):
    message = getattr(bb_msgs, name)

    assert {key: getattr(message, key) for key in CONSTANTS[name]} == CONSTANTS[name]


def test_the_arrays_hold_tasks_and_bids():
    assert bb_msgs.TaskMsgArray(tasks=[bb_msgs.TaskMsg()]).tasks[0].id == ""
    assert bb_msgs.TaskCostArray(costs=[bb_msgs.TaskCost()]).costs[0].cost == 0


def test_a_task_arrives_over_a_topic_as_it_was_sent():
    sent = bb_msgs.TaskMsg(id="T1", type=TaskType.GAB, priority=10, payload=12.5)
    sent.goals = [Pose2D(3, 4, 0.5), Pose2D(8, 2, -3)]
    publisher = rospy.Publisher("new_task", bb_msgs.TaskMsg, queue_size=1, latch=True)
    publisher.publish(sent)

    received = rospy.wait_for_message("new_task", bb_msgs.TaskMsg, timeout=PATIENCE)

    assert received == sent
