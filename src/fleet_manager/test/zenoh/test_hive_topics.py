# SPDX-License-Identifier: BSD-3-Clause
"""What operators' programs hear and say over Zenoh."""

import itertools
import queue
from dataclasses import replace
from types import SimpleNamespace

import pytest

from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskUpdate
from blackboard.domain.talker import (
    BACKUP,
    NEW_TASK,
    ROBOT_STATUS,
    SET_STATE,
    SYNC,
    TASK_CANCEL,
    TASK_STATE,
)
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.client.reports import HiveMessage
from fleet_manager.client.topics import STATE, ZONE_COMMAND
from fleet_manager.client.traffic import ZoneCommand
from fleet_manager.desk.facts import CancelTask, PostTask, SetRobotState
from fleet_manager.zenoh import hive_topics
from fleet_manager.zenoh.hive_topics import ZenohTopics
from hive_common.pose import Pose

WITHIN = 20.0
TASK = Task("T1", TaskType.GA, (Pose(1.0, 2.0),))
UPDATE = TaskUpdate("T1", TaskState.STARTED, "robot1", 0, 1)
LIST = TaskList(1, 3, (), "hive1")


def status(robot, state=RobotState.IDLE):
    return RobotStatus(robot, state, Pose(1.0, 2.0), 0.5)


class Program:
    """An operator's program, and what it was told."""

    def __init__(self, session, own):
        self.facts = queue.Queue()
        self.met, self.warnings = [], []
        put = self.facts.put
        self.topics = ZenohTopics(
            session,
            own,
            lambda fact, supersedes=None: put((fact, supersedes)),
            self.met.append,
            self.warnings.append,
        )

    def next(self, kind):
        """Return the next report of a kind, with its stamp and what it replaces."""
        while True:
            message, supersedes = self.facts.get(timeout=WITHIN)
            if isinstance(message.report, kind):
                return message, supersedes


@pytest.fixture
def program(session, site, leader, until_followed):
    """A program that has heard who leads."""
    program = Program(session, site.settings.own(""))
    until_followed(BACKUP)
    leader.beat()
    program.next(Heartbeat)
    return program


@pytest.fixture
def follower(program, until_followed):
    """A program that follows all of the hive's state."""
    program.topics.listen(STATE)
    until_followed()
    return program


@pytest.mark.parametrize(
    ("topic", "value", "supersedes"),
    [(TASK_STATE, UPDATE, None), (SYNC, LIST, SYNC)],
)
def test_a_report_comes_with_its_stamp_and_what_it_replaces(
    leader, follower, topic, value, supersedes
):
    leader.say(topic, value)

    assert follower.next(type(value)) == (HiveMessage(value, 7.0), supersedes)


def test_who_begins_to_listen_gets_the_list_and_what_robots_told_last(leader, program):
    leader.say(SYNC, LIST)
    leader.say(ROBOT_STATUS, status("robot1"), by="robot1")

    program.topics.listen(STATE)

    kinds = {type(program.facts.get(timeout=WITHIN)[0].report) for _ in range(2)}
    assert kinds == {TaskList, RobotStatus}


def test_only_a_leader_tells_what_the_robots_of_others_do(session, site, leader, until_followed):
    program = Program(session, site.settings.own(""))
    program.topics.listen(STATE)
    until_followed()
    last = replace(UPDATE, step=1)
    leader.say(TASK_STATE, UPDATE)  # nobody has heard it lead
    leader.say(TASK_STATE, last, by="robot1")
    assert program.next(TaskUpdate)[0].report == last
    leader.beat()
    program.next(Heartbeat)
    leader.say(TASK_STATE, UPDATE)

    assert program.next(TaskUpdate)[0].report == UPDATE
    assert len(program.warnings) == 1
    assert "blackboard speaks as robot1" in program.warnings[0]


def test_a_hive_whose_nodes_run_in_a_namespace_is_heard_in_that_namespace(
    session, site, leader, until_followed, monkeypatch
):
    monkeypatch.setenv("ROS_NAMESPACE", "/hall/")
    program = Program(session, site.settings.own(""))
    until_followed(BACKUP)
    leader.say(BACKUP, Heartbeat(1, "/hall/blackboard", "", ("/hall/blackboard",)))

    assert program.next(Heartbeat)[0].report.leader == "/hall/blackboard"
    assert program.warnings == []


def test_bytes_that_are_no_message_are_refused_with_one_line(leader, follower):
    for _ in range(3):
        leader.session.put("hive/hive/task_state/robot2", b"\x01")
    leader.say(TASK_STATE, UPDATE)

    follower.next(TaskUpdate)

    assert follower.warnings == [
        "a message on task_state is refused: robot2 sends bytes that are no TaskState"
    ]


def test_windows_read_the_newest_list_when_they_have_time(leader, program, until_followed):
    program.topics.listen_to_all()
    until_followed()
    for version in (3, 4):
        leader.say(SYNC, TaskList(1, version, (), "hive1"))
    leader.say(TASK_STATE, UPDATE)
    assert isinstance(program.facts.get(timeout=WITHIN)[0].report, TaskUpdate)

    program.topics.read_list()
    program.topics.read_list()

    assert program.next(TaskList)[0].report.version == 4
    assert program.facts.empty()


def test_each_robot_is_met_once_and_heard_when_it_speaks_itself(leader, follower):
    leader.say(ROBOT_STATUS, status("robot2", RobotState.OFFLINE))
    for _ in range(2):
        leader.say(ROBOT_STATUS, status("robot1"), by="robot1")
    for _ in range(3):
        follower.next(RobotStatus)
    leader.say(TASK_STATE, UPDATE)  # what comes before is noted then
    follower.next(TaskUpdate)

    assert follower.met == ["robot2", "robot1"]
    assert follower.topics.heard == {"robot1"}


def test_the_hives_time_is_that_of_its_heartbeats(leader, program):
    leader.beat()
    program.next(Heartbeat)  # the one before was noted then

    assert program.topics.time == 7.0


@pytest.mark.parametrize(
    ("request_", "topic", "value"),
    [
        (PostTask(TASK), NEW_TASK, TASK),
        (CancelTask("T1"), TASK_CANCEL, "T1"),
        (SetRobotState("robot1", "defect"), SET_STATE, "defect"),
    ],
)
def test_the_hive_hears_a_request_once(leader, program, request_, topic, value):
    program.topics.speak(request_)
    program.topics.speak(CancelTask("the end"))

    assert leader.asked.get(timeout=WITHIN) == (topic, value)
    assert leader.asked.get(timeout=WITHIN) == (TASK_CANCEL, "the end")


def test_the_traffic_planner_hears_which_zone_is_closed(leader, program):
    program.topics.speak(ZoneCommand("aisle", closed=True))

    topic, msg = leader.asked.get(timeout=WITHIN)
    assert (topic, msg.zone, msg.closed) == (ZONE_COMMAND, "aisle", True)


def test_a_request_waits_until_somebody_listens(program, leader, monkeypatch):
    answers = iter([False, False, True])
    asked = []
    monkeypatch.setattr(
        "blackboard.zenoh.link.ZenohLink.is_heard",
        lambda _link, name: asked.append(name) or next(answers),
    )

    program.topics.speak(CancelTask("T1"))

    assert asked == [TASK_CANCEL] * 3
    assert leader.asked.get(timeout=WITHIN) == (TASK_CANCEL, "T1")


def test_a_request_waits_for_the_leader_whose_answer_would_not_be_believed_before(
    session, site, leader, until_followed, monkeypatch
):
    program = Program(session, site.settings.own(""))
    until_followed(BACKUP)
    early = []

    def sleep(_seconds):
        early.append(leader.asked.empty())
        leader.beat()
        program.next(Heartbeat)

    monkeypatch.setattr(hive_topics, "time", SimpleNamespace(monotonic=lambda: 0.0, sleep=sleep))
    program.topics.speak(CancelTask("T1"))

    assert early
    assert all(early)
    assert leader.asked.get(timeout=WITHIN) == (TASK_CANCEL, "T1")


def test_a_request_that_nobody_can_hear_is_published_all_the_same_after_a_while(
    session, site, monkeypatch
):
    program = Program(session, site.settings.own(""))
    now = itertools.count()
    monkeypatch.setattr(
        hive_topics, "time", SimpleNamespace(monotonic=lambda: next(now), sleep=lambda _: None)
    )
    published = []
    monkeypatch.setattr(
        "blackboard.zenoh.link.ZenohLink.publish", lambda _link, *what: published.append(what)
    )

    program.topics.speak(CancelTask("T1"))

    assert published == [("", TASK_CANCEL, "T1", None)]


@pytest.mark.parametrize("name", ["", "a/b", "*", "**", "robot 1", "r" * 65])
def test_a_robot_that_no_key_can_name_is_not_commanded(program, name):
    program.topics.speak(SetRobotState(name, "defect"))

    assert program.warnings == [f"robot {name[:64]!r} cannot be commanded: it is no name"]
