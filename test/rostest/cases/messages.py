# SPDX-License-Identifier: BSD-3-Clause
"""The operator's contract: fields and constants of the messages, as generated for Python."""

import blackboard.msg as bb_msgs
import pytest
import rospy
from geometry_msgs.msg import Pose2D

from blackboard.consensus.messages import AppendReply
from blackboard.costing.bid_basis import BidBasis, Bids
from blackboard.domain.bid import Bid, CostTerms
from blackboard.domain.record import Broadcast, Order, OrderKind
from blackboard.domain.talker import BB_ACK, TASK_ASSIGN, TASK_BROADCAST, TASK_COST
from blackboard.domain.task import Task, TaskType
from blackboard.ros.codec.conversions import WIRES
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT

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

    received = rospy.wait_for_message("new_task", bb_msgs.TaskMsg, timeout=10)

    assert received == sent


@pytest.mark.parametrize("kind", OrderKind, ids=lambda kind: kind.name)
def test_an_order_of_any_kind_is_read_as_it_was_given(kind):
    given = Order(Task("T1", TaskType.GA, (Pose(1.0, 2.0),)), "robot1", kind, assignment=3)
    wire = WIRES[TASK_ASSIGN]
    msg = wire.to_msg(given)

    assert msg.order == getattr(msg, kind.name)
    assert wire.from_msg(msg) == given


def test_a_call_for_bids_is_read_as_it_was_made():
    tasks = tuple((Task(f"T{step}", TaskType.GA, (Pose(1.0, 2.0),)), step) for step in range(3))
    asked = {"robot1": "", "robot2": "T7"}
    given = Broadcast(2, 3, tasks, "hive", round=4, asked=asked, basis=True, sizes=(2, 1))
    wire = WIRES[TASK_BROADCAST]

    assert wire.from_msg(wire.to_msg(given)) == given


def test_bids_are_read_as_they_were_made():
    terms = CostTerms(0.5, 7.0, 2, 11.0, 13.0, 17.0, 19.0, 0.25)
    taken = Bid("robot1", "T1", 300.0, 0.5, 13.0, terms=terms, size=3)
    begun = Bid("robot1", "T4", 9.0, 0.0, 5.0, under_way="T2", interrupt_cost=20.0)
    refused = Bid("robot1", "T5", 1000.0, reason="heavy", most_payload=4.0, exclusion="payload")
    given = Bids("robot1", 2, 3, (taken, begun, refused), 4, None)
    wire = WIRES[TASK_COST]

    assert wire.from_msg(wire.to_msg(given)) == given


@pytest.mark.parametrize("stands_by", [True, False])
def test_an_acknowledgement_is_read_as_it_was_given(stands_by):
    given = AppendReply("robot1#1", 2, 3, 4.0, "hive", stands_by)
    wire = WIRES[BB_ACK]

    assert wire.from_msg(wire.to_msg(given)) == given


def test_what_a_robot_tells_of_itself_is_read_as_it_was_told():
    tasks, chargers = (("T1", 0), ("T2", 3)), (Pose(1.0, 2.0, 3.0),)
    what = (SMALL_ROBOT, "latency", 60.0, Pose(4.0, 5.0), 0.7, True, "it charges")
    told = BidBasis(*what, tasks, chargers, (2.0, 1.4, 0.6))
    given = Bids("robot1", 2, 3, (), 4, told)
    wire = WIRES[TASK_COST]

    assert wire.from_msg(wire.to_msg(given)) == given
