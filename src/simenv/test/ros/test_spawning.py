# SPDX-License-Identifier: BSD-3-Clause
import pytest

pytest.importorskip("simenv.srv", reason="needs ROS and the generated messages")

import rospy
from simenv.srv import SpawnResponse

from hive_common.pose import Pose
from simenv.errors import SimenvError, SpawnError
from simenv.ros import spawning

FAR = Pose(100.0, 100.0, 0.0)
HERE = Pose(2.0, 2.0, 0.0)


@pytest.fixture
def said(monkeypatch):
    """Answer as a simulator that refuses whatever stands beyond 50 m; return what is logged."""
    lines = []

    def answer(name, _model, pose):
        if pose.x > 50.0:
            return SpawnResponse(False, f"{name} cannot stand there: outside the world")
        return SpawnResponse(True, f"{name} stands there")

    monkeypatch.setattr(rospy, "wait_for_service", lambda *_: None)
    monkeypatch.setattr(rospy, "ServiceProxy", lambda *_: answer)
    monkeypatch.setattr(rospy, "resolve_name", lambda name: f"/{name}")
    monkeypatch.setattr(rospy, "set_param", lambda name, text: lines.append((name, text)))
    monkeypatch.setattr(rospy, "has_param", lambda _name: False)
    for level in ("loginfo", "logfatal"):
        monkeypatch.setattr(rospy, level, lambda text, level=level: lines.append((level, text)))
    return lines


def spawned(**poses):
    return spawning.spawn_each(poses.items(), lambda each: (each[0], "mir100", each[1]), 1.0)


def test_a_robot_that_is_refused_holds_up_no_other(said):
    standing = spawned(amy=HERE, bob=FAR, carol=HERE)

    assert [name for name, _ in standing] == ["amy", "carol"]
    errors = [text for level, text in said if level == "logfatal"]
    assert len(errors) == 1
    assert ("/refused_to_start/bob/reason", errors[0]) in said
    assert "bob cannot stand there: outside the world" in errors[0]
    assert "all others go on" in errors[0]


@pytest.mark.usefixtures("said")
def test_where_no_robot_can_stand_the_node_has_nothing_to_do():
    with pytest.raises(SpawnError, match="none of this node's robots can start"):
        spawned(amy=FAR, bob=FAR)


def test_a_node_without_robots_asks_nobody(monkeypatch):
    monkeypatch.setattr(rospy, "wait_for_service", lambda *_: pytest.fail("asked"))

    assert spawned() == []


def test_a_simulator_that_does_not_answer_is_named_with_what_starts_one(monkeypatch):
    def wait(*_):
        raise rospy.ROSException("timeout")

    monkeypatch.setattr(rospy, "wait_for_service", wait)

    with pytest.raises(SimenvError, match=r"no simulator answered .* within 1 s; start one with"):
        spawned(amy=HERE)


def test_a_simulator_that_ends_is_told_of_each_robot_in_one_line(said, monkeypatch):
    def ends(*_):
        raise rospy.ServiceException("connection closed")

    monkeypatch.setattr(rospy, "ServiceProxy", lambda *_: ends)

    with pytest.raises(SpawnError):
        spawned(amy=HERE)
    assert "the simulator ended while amy was being spawned" in said[0][1]
