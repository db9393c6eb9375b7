# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

from fleet_manager.desk import inbox
from fleet_manager.desk.facts import PlannedPath
from fleet_manager.desk.inbox import Inbox


def path(robot, length=0):
    return PlannedPath(robot, ((0.0, 0.0),) * length)


def test_facts_are_taken_in_the_order_they_came_and_only_once():
    box = Inbox()
    for number in range(3):
        box.put(path(f"robot{number}"))

    assert box.take(2) == [path("robot0"), path("robot1")]
    assert box.take(2) == [path("robot2")]
    assert box.take(2) == []


def test_a_superseded_fact_is_dropped_and_the_newer_one_keeps_its_own_place():
    box = Inbox()
    box.put(path("robot1", 1), "robot1")
    box.put(path("robot2"))
    box.put(path("robot1", 2), "robot1")

    assert box.take(9) == [path("robot2"), path("robot1", 2)]


def test_the_oldest_fact_is_dropped_when_too_much_waits(monkeypatch):
    monkeypatch.setattr(inbox, "MAX_FACTS", 3)
    box = Inbox()
    for number in range(5):
        box.put(path(f"robot{number}"))

    assert [fact.robot for fact in box.take(9)] == ["robot2", "robot3", "robot4"]
