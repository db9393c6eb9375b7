# SPDX-License-Identifier: BSD-3-Clause
"""Two nodes that speak for the same robot."""

from dataclasses import replace

import pytest

pytest.importorskip("blackboard.msg", reason="the talker needs generated messages")

from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.process.speakers import SPEAKER_TIMEOUT, Speakers
from hive_common.last_heard import FORGOTTEN_AFTER
from hive_common.pose import Pose

IDLE = RobotStatus("robot1", RobotState.IDLE, Pose(0.0, 0.0), charge=1.0)
OFFLINE = RobotStatus("robot1", RobotState.OFFLINE, Pose(0.0, 0.0), charge=1.0)


def test_the_first_node_that_speaks_for_a_robot_is_believed_and_a_second_one_refused():
    speakers = Speakers()

    assert not speakers.why_refused(IDLE, "/robot1/robot", 0.0)
    assert speakers.why_refused(IDLE, "/other/robot", 1.0) == (
        "/other/robot speaks as robot1, which /robot1/robot does already; "
        "give the robots names of their own"
    )
    assert not speakers.why_refused(IDLE, "/robot1/robot", 2.0)


def test_a_silent_node_gives_up_the_name():
    speakers = Speakers()
    speakers.why_refused(IDLE, "/robot1/robot", 0.0)

    assert not speakers.why_refused(IDLE, "/other/robot", SPEAKER_TIMEOUT)


def test_the_blackboard_is_believed_about_a_lost_robot():
    speakers = Speakers()
    speakers.why_refused(IDLE, "/robot1/robot", 0.0)

    assert not speakers.why_refused(OFFLINE, "/blackboard", 1.0)


def test_nodes_that_have_not_spoken_for_long_are_forgotten():
    speakers = Speakers()
    speakers.why_refused(IDLE, "/robot1/robot", 0.0)
    speakers.why_refused(replace(IDLE, robot_id="robot2"), "/robot2/robot", FORGOTTEN_AFTER)

    assert speakers.node_of("robot1") == ""
    assert speakers.node_of("robot2") == "/robot2/robot"
