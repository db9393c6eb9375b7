# SPDX-License-Identifier: BSD-3-Clause
"""The traffic planner hears robots and the map while it is still being loaded."""

from __future__ import annotations

import subprocess
import sys
from types import SimpleNamespace

import pytest

pytest.importorskip("robot_description.msg", reason="robots speak in generated messages")

from robot_description.msg import Traffic

from hive_navigation.ros import traffic_ears
from hive_navigation.ros.traffic_ears import Ears

HEAVY = ("numba", "scipy", "hive_navigation.traffic.coordinator")
"""What only the planner needs, and what takes long to import."""


@pytest.fixture
def master(monkeypatch):
    """A master that gives the messages of the test to who subscribes."""
    known = SimpleNamespace(now=7.0, callbacks={}, unregister=lambda: None)

    def subscribe(topic, _kind, callback, queue_size):  # noqa: ARG001  (rospy's argument)
        known.callbacks[topic] = callback
        return known

    monkeypatch.setattr(traffic_ears.rospy, "Subscriber", subscribe)
    monkeypatch.setattr(traffic_ears.rospy, "get_time", lambda: known.now)
    return known


def test_of_each_robot_the_newest_word_counts(master):
    ears = Ears("/east/")
    for name, claim in (("a", 1.0), ("b", 2.0), ("a", 3.0)):
        master.callbacks["/east/traffic"](Traffic(name=name, claim=claim))

    assert [(msg.name, msg.claim) for msg in ears.news()] == [("a", 3.0), ("b", 2.0)]
    assert list(ears.news()) == []


def test_it_knows_since_when_robots_were_heard_also_if_nobody_has_asked_yet(master):
    ears = Ears("/")
    for now in (7.0, 9.0):
        master.now = now
        master.callbacks["/traffic"](Traffic(name="a"))

    assert len(list(ears.news())) == 1
    assert ears.since == 7.0


def test_to_listen_nothing_of_the_planner_is_imported():
    program = (
        "import sys, hive_navigation.ros.traffic_planner_node; "
        f"print([name for name in {HEAVY} if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )

    assert done.stdout.strip() == "[]"
