# SPDX-License-Identifier: BSD-3-Clause
"""A node warns once about each topic that stays silent."""

from __future__ import annotations

import pytest

pytest.importorskip("rospy")

from hive_common.ros.inbox import Inbox
from hive_navigation.ros.topic_monitor import PATIENCE, TopicMonitor


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_an_overdue_topic_is_named_once_until_a_message_comes_again() -> None:
    clock = Clock()
    monitor = TopicMonitor(Inbox(), clock)
    monitor.expect("scan", "start the laser")
    monitor.expect("odom", "start the base")

    def overdue_at(time: float) -> list[str]:
        clock.now = time
        return monitor.overdue()

    clock.now = 5.0
    monitor.heard("odom")
    assert overdue_at(PATIENCE - 0.1) == []
    assert overdue_at(PATIENCE) == ["scan"]
    assert overdue_at(PATIENCE + 1.0) == []
    assert overdue_at(PATIENCE + 5.0) == ["odom"]
    clock.now = 16.0
    monitor.heard("scan")
    assert overdue_at(15.9 + PATIENCE) == []
    assert overdue_at(16.0 + PATIENCE) == ["scan"]


def test_a_message_counts_when_the_main_thread_handles_it(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, inbox, handled, callbacks = Clock(), Inbox(), [], []
    monkeypatch.setattr(
        "rospy.Subscriber", lambda _topic, _kind, callback, **_: callbacks.append(callback)
    )
    monitor = TopicMonitor(inbox, clock)
    monitor.subscribe("scan", object, handled.append, 1, "start the laser")

    callbacks[0]("a scan")
    assert handled == []
    clock.now = PATIENCE
    inbox.empty()

    assert handled == ["a scan"]
    assert monitor.overdue() == []
