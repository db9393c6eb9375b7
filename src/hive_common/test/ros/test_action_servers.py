# SPDX-License-Identifier: BSD-3-Clause
"""The status of an action server goes on when ROS time is set back, and ends with its node."""

from contextlib import nullcontext
from types import SimpleNamespace

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from hive_common.ros import action_servers


class Server:
    """An action server as actionlib has it once it was started."""

    def __init__(self, frequency):
        self.status_frequency = frequency
        self.old = SimpleNamespace(is_shut=False)
        self.old.shutdown = lambda: setattr(self.old, "is_shut", True)

    def start(self):
        if self.status_frequency > 0.0:
            self.status_timer = self.old

    def publish_status_async(self, event):
        """Tell the status, as a node does whose topics are closed."""
        self.told = event
        raise rospy.ROSException("publish() to a closed topic")


@pytest.fixture
def timers(monkeypatch):
    """What was asked of every timer: period [s], action, whether it goes on after a reset."""
    made = []
    monkeypatch.setattr(
        rospy,
        "Timer",
        lambda period, act, reset=False: made.append((period.to_sec(), act, reset)),
    )
    return made


@pytest.mark.parametrize("wrap", [lambda each: each, None], ids=["server", "simple server"])
def test_its_timer_goes_on_after_a_reset(timers, wrap):
    inner = Server(5.0)
    server = wrap(inner) if wrap else SimpleNamespace(action_server=inner, start=inner.start)

    action_servers.start(server)

    assert inner.old.is_shut
    [(period, _, goes_on)] = timers
    assert (period, goes_on) == (0.2, True)


@pytest.mark.parametrize("state", ["works", "is asked to shut down", "is shut down"])
def test_a_topic_that_is_closed_is_an_error_unless_the_node_is_shut_down(
    timers, monkeypatch, state
):
    server = Server(5.0)
    monkeypatch.setattr(rospy, "is_shutdown", lambda: state == "is shut down")
    monkeypatch.setattr(
        rospy.core, "is_shutdown_requested", lambda: state == "is asked to shut down"
    )
    action_servers.start(server)
    [(_, tell, _)] = timers

    with pytest.raises(rospy.ROSException) if state == "works" else nullcontext():
        tell("event")

    assert server.told == "event"


def test_a_server_that_is_to_tell_nothing_gets_no_timer(timers):
    server = Server(0.0)

    action_servers.start(server)

    assert timers == []
