# SPDX-License-Identifier: BSD-3-Clause
"""What members and nodes of the hive say is wrong."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from fleet_manager.ros import troubles


@pytest.fixture
def say(monkeypatch):
    heard, known, now = [], {}, [0.0]
    monkeypatch.setattr(
        troubles.rospy, "Subscriber", lambda _topic, _type, hear, **_: heard.append(hear)
    )
    monkeypatch.setattr(troubles, "refusals", lambda: known)
    monkeypatch.setattr(troubles.time, "monotonic", lambda: now[0])
    found = troubles.Troubles()

    def say(name, level, text=""):
        heard[0](DiagnosticArray(status=[DiagnosticStatus(level, name, text, "", [])]))

    say.found, say.refused, say.now = found, known, now
    return say


def test_errors_of_members_are_troubles_until_the_member_is_well(say):
    say("robot1: hive", DiagnosticStatus.ERROR, "no quorum")
    say("robot2: hive", DiagnosticStatus.WARN, "a clock is off")
    say("a camera", DiagnosticStatus.ERROR, "no picture")
    assert say.found.read() == ("no quorum",)

    say("robot1: hive", DiagnosticStatus.OK)
    assert say.found.read() == ()


def test_the_error_of_a_member_that_is_gone_is_no_news(say):
    say("robot1: hive", DiagnosticStatus.ERROR, "no quorum")
    say.now[0] = 6.0

    assert say.found.read() == ()


def test_what_kept_a_node_from_starting_comes_first(say):
    say("robot1: hive", DiagnosticStatus.ERROR, "no quorum")
    say.refused["robot2/robot"] = "the model is missing"

    assert say.found.read() == ("robot2/robot did not start: the model is missing", "no quorum")
