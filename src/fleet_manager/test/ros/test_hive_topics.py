# SPDX-License-Identifier: BSD-3-Clause
import pytest

pytest.importorskip("blackboard.msg", reason="needs the generated messages")

from fleet_manager.ros import hive_topics


@pytest.fixture
def clock(monkeypatch):
    """A clock that the test sets; its first element is the time [s]."""
    time = [100.0]
    monkeypatch.setattr(hive_topics.time, "monotonic", lambda: time[0])
    return time


def test_who_connects_soon_after_a_request_gets_it_too(clock):
    late, told = hive_topics.LateSubscribers(), []
    late.publish(told.append, "task")
    clock[0] += 0.5

    late.peer_subscribe("/new_task", None, told.append)

    assert told == ["task", "task"]


def test_who_connects_later_gets_nothing_old(clock):
    late, told = hive_topics.LateSubscribers(), []
    late.publish(told.append, "task")
    clock[0] += 1.0

    late.peer_subscribe("/new_task", None, told.append)

    assert told == ["task"]


def test_who_connects_before_any_request_gets_nothing():
    told = []
    hive_topics.LateSubscribers().peer_subscribe("/new_task", None, told.append)

    assert told == []
