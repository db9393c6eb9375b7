# SPDX-License-Identifier: BSD-3-Clause
"""Who may say what in whose name."""

import pytest

from blackboard.consensus.log import Position
from blackboard.consensus.messages import AppendEntries, AppendReply, Ballot, BallotKind, Heartbeat
from blackboard.costing.bid_basis import Bids
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskUpdate
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.zenoh.authenticity import Authenticity
from hive_common.pose import Pose

HEARTBEAT = Heartbeat(3, "/robot1/robot#1")
ENTRIES = AppendEntries(3, "/robot1/robot#1", Position(0, 0), (), 0, 1.0)
REPLY = AppendReply("/robot1/robot#1", 3, 7, 1.5)
VOTE = Ballot(BallotKind.VOTE_REPLY, 3, "/robot2/robot#2", "/robot1/robot#1", Position(0, 0), True)
BIDS = Bids("robot1", 3, 1, ())
REPORT = TaskUpdate("T1", TaskState.DONE, "robot1", 1, 1)


def status(state):
    return RobotStatus("robot1", state, Pose(0.0, 0.0), 0.5)


OWN = [HEARTBEAT, ENTRIES, REPLY, VOTE, BIDS, REPORT, status(RobotState.IDLE)]


class Clock:
    """Time that a test sets [s]."""

    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def heard(clock):
    return Authenticity("/", clock)


@pytest.mark.parametrize("message", OWN, ids=lambda each: type(each).__name__)
def test_a_robot_speaks_for_itself_and_no_other_robot_does(heard, message):
    assert heard.why_refused(message, "robot1") == ""
    assert "robot2 speaks as " in heard.why_refused(message, "robot2")


@pytest.mark.parametrize("sender", ["robot", "robot1/robot", "/robot1/robot", "robot11", ""])
def test_a_name_that_only_looks_alike_is_another(heard, sender):
    assert heard.why_refused(REPLY, sender)
    assert heard.why_refused(BIDS, sender)


def test_names_of_members_are_below_the_namespace_of_the_hive(clock):
    heard = Authenticity("/fleet2/", clock)
    reply = AppendReply("/fleet2/robot1/robot#1", 3, 7, 1.5)

    assert heard.why_refused(reply, "robot1") == ""
    assert heard.why_refused(reply, "fleet2")


@pytest.mark.parametrize(
    "message", [REPORT, TaskUpdate("T2", TaskState.WAITING), status(RobotState.OFFLINE)]
)
def test_only_who_leads_tells_what_others_do(heard, clock, message):
    assert heard.why_refused(message, "robot3")

    heard.why_refused(Heartbeat(4, "/robot3/robot#3"), "robot3")
    assert heard.why_refused(message, "robot3") == ""

    clock.now += 11.0
    assert heard.why_refused(message, "robot3")


def test_a_forged_heartbeat_makes_nobody_a_leader(heard):
    heard.why_refused(HEARTBEAT, "robot2")

    assert heard.why_refused(REPORT, "robot2")


def test_a_leader_tells_what_others_do_but_neither_bids_nor_answers_for_them(heard):
    heard.why_refused(Heartbeat(4, "/robot3/robot#3"), "robot3")

    for message in (BIDS, REPLY, VOTE, status(RobotState.IDLE)):
        assert heard.why_refused(message, "robot3")


def test_what_names_no_sender_is_left_to_the_access_list(heard):
    task = Task("T1", TaskType.GA, (Pose(1.0, 1.0),))

    assert heard.why_refused(task, "anna") == heard.why_refused("T1", "anna") == ""


def test_a_long_name_is_cut_short(heard):
    assert len(heard.why_refused(Bids("x" * 10_000, 3, 1, ()), "robot2")) < 300
