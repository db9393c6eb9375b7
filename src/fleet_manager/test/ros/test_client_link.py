# SPDX-License-Identifier: BSD-3-Clause
import pytest

pytest.importorskip("blackboard.msg", reason="needs the generated messages")

import rosgraph
import yaml

from blackboard.codec.tables import WIRES
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.talker import ROBOT_STATUS
from fleet_manager.errors import NoHiveError
from fleet_manager.ros import client_link, hive_topics
from hive_common.pose import Pose
from hive_common.resources import find_file

HOST = "/robot_host_1"
MODEL = find_file("robot_description", "models", "mir100")


class Master:
    """A ROS master that knows of one process of two robots."""

    def __init__(self, _name):
        pass

    def getSystemState(self):  # noqa: N802  (rosgraph's name)
        return [["/robot_status", [HOST]]], [], []


@pytest.fixture
def tell(monkeypatch):
    """Return a link, and what lets it hear the status of a robot."""
    callbacks = []
    monkeypatch.setattr(rosgraph, "Master", Master)
    monkeypatch.setattr(
        hive_topics.rospy, "Subscriber", lambda _topic, _type, hear, **_: callbacks.append(hear)
    )
    monkeypatch.setattr(client_link.rospy.rostime, "_rostime_initialized", True)
    link = client_link.RosClientLink()
    link.listen(ROBOT_STATUS)

    def say(robot):
        status = RobotStatus(robot, RobotState.IDLE, Pose(0.0, 0.0, 0.0), 1.0, 0.0, "", "", ())
        msg = WIRES[ROBOT_STATUS].encode(status)
        msg._connection_header = {  # noqa: SLF001  (rospy sets it)
            "callerid": HOST,
            "robots": "robot1 robot2",
        }
        callbacks[0](msg)

    return link, say


def test_robots_count_as_heard_once_all_reports_of_them_have_been_received(tell):
    link, say = tell
    say("robot1")
    say("robot2")
    assert not link.has_heard_robots()

    received = {link.receive(0.0).report.robot_id for _ in range(2)}

    assert received == {"robot1", "robot2"}
    assert link.has_heard_robots()


def test_robots_do_not_count_as_heard_while_one_is_missing(tell):
    link, say = tell
    say("robot2")
    link.receive(0.0)

    assert not link.has_heard_robots()


def test_the_simulated_time_is_waited_for_until_it_is_told(tell, monkeypatch):
    link, _ = tell
    times = iter([0.0, 0.0, 12.5])
    monkeypatch.setattr(client_link.rospy, "get_time", lambda: next(times))

    assert link.hive_time(within=5.0) == 12.5


def test_a_time_that_nobody_tells_is_unknown(tell, monkeypatch):
    link, _ = tell
    monkeypatch.setattr(client_link.rospy, "get_time", lambda: 0.0)

    assert link.hive_time(within=0.05) == 0.0


def test_how_wide_a_robot_is_comes_from_its_model_and_is_unknown_without_one(monkeypatch):
    models = {
        "robot1/characteristics": yaml.safe_load(MODEL.read_text()),
        "robot2/characteristics": 3,
    }
    monkeypatch.setattr(client_link.rospy, "get_param", models.__getitem__)
    link = client_link.RosClientLink.__new__(client_link.RosClientLink)  # it needs no topics

    assert link.radius_of("robot1") == pytest.approx(0.29, abs=0.005)
    assert link.radius_of("robot2") is None
    assert link.radius_of("robot3") is None


def test_what_a_robot_has_learned_comes_from_its_parameter_whatever_that_holds(monkeypatch):
    held = {"robot1/learned": {"clipped": 3}, "robot2/learned": "odd"}
    monkeypatch.setattr(client_link.rospy, "get_param", held.get)
    link = client_link.RosClientLink.__new__(client_link.RosClientLink)  # it needs no topics

    assert link.learned_of("robot1") == {"clipped": 3}
    assert link.learned_of("robot2") == "odd"
    assert link.learned_of("robot3") is None


@pytest.mark.parametrize("error", [OSError("refused"), client_link.rospy.ROSException("refused")])
def test_a_master_that_is_gone_is_said_where_it_would_tell_what_was_learned(monkeypatch, error):
    def get_param(_name, _default):
        raise error

    monkeypatch.setattr(client_link.rospy, "get_param", get_param)
    link = client_link.RosClientLink.__new__(client_link.RosClientLink)  # it needs no topics

    with pytest.raises(NoHiveError, match=r"what robot1 has learned: refused; start it again"):
        link.learned_of("robot1")
