# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

from dataclasses import replace

import pytest

from blackboard.consensus.task_list import TaskList
from blackboard.domain.record import TaskRecord, TaskUpdate
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.client.reports import HiveMessage
from fleet_manager.client.traffic import TrafficState, ZoneCommand
from fleet_manager.desk.facts import CancelTask, PostTask
from fleet_manager.desk.requests import MAX_SHOWN, REPEAT, Answer, RequestQueue
from hive_common.pose import Pose

TASK = Task("T1", TaskType.GA, (Pose(1, 2),), frame="map")


class Desk:
    """A queue of requests, what it sent, and a clock."""

    def __init__(self):
        self.sent = []
        self.queue = RequestQueue(self.sent.append)
        self.time = 100.0

    def tick(self, after=0.0, someone_listens=True):
        self.time += after
        return self.queue.tick(self.time, someone_listens=someone_listens)

    def hear(self, report, listed=None):
        return self.queue.hear(HiveMessage(report, 0.0), {r.task.id: r for r in listed or ()}.get)

    @property
    def answer(self):
        return self.queue.sent_tasks[0].answer


@pytest.fixture
def desk():
    desk = Desk()
    desk.queue.post(TASK)
    return desk


def test_a_task_is_sent_at_once_when_somebody_listens(desk):
    desk.tick()

    assert desk.sent == [PostTask(TASK)]
    assert desk.answer is Answer.WAITS


def test_a_task_is_kept_while_nobody_listens_and_sent_when_somebody_does(desk):
    desk.tick(someone_listens=False)
    assert (desk.sent, desk.answer) == ([], Answer.KEPT)

    desk.tick()
    assert (desk.sent, desk.answer) == ([PostTask(TASK)], Answer.WAITS)


def test_a_task_is_sent_again_until_it_is_answered(desk):
    desk.tick()
    desk.tick(after=REPEAT / 2)
    desk.tick(after=REPEAT)
    assert len(desk.sent) == 2

    desk.hear(TaskUpdate("T1", TaskState.WAITING))
    desk.tick(after=REPEAT)
    assert len(desk.sent) == 2
    assert desk.answer is Answer.TAKEN


def test_a_task_that_was_sent_is_kept_when_the_blackboard_dies_before_its_answer(desk):
    desk.tick()

    assert desk.tick(after=0.1, someone_listens=False)
    assert desk.answer is Answer.KEPT


def test_a_refused_task_shows_its_reason_and_is_not_sent_again(desk):
    desk.tick()
    desk.hear(TaskUpdate("T1", TaskState.REJECTED, reason="goal A is in a wall"))
    desk.tick(after=REPEAT)

    assert len(desk.sent) == 1
    assert str(desk.queue.sent_tasks[0]) == "T1: rejected: goal A is in a wall"


def test_the_task_list_is_an_answer_too(desk):
    desk.tick()

    assert desk.hear(TaskList(1, 1, (TaskRecord(TASK),)))
    assert desk.answer is Answer.TAKEN


def test_news_of_another_task_of_the_same_name_is_no_answer(desk):
    desk.tick()
    other = TaskRecord(replace(TASK, priority=9))
    desk.hear(TaskUpdate("T1", TaskState.STARTED), listed=[other])
    desk.hear(TaskList(1, 1, (other,)))

    assert desk.answer is Answer.WAITS


def test_a_late_refusal_does_not_undo_an_answer(desk):
    desk.tick()
    desk.hear(TaskUpdate("T1", TaskState.WAITING))
    desk.hear(TaskUpdate("T1", TaskState.REJECTED, reason="taken"))

    assert desk.answer is Answer.TAKEN


def test_a_cancellation_is_repeated_until_the_task_has_ended(desk):
    desk.queue = RequestQueue(desk.sent.append)
    desk.queue.cancel("T1")
    desk.tick()
    desk.tick(after=REPEAT)
    assert desk.sent == [CancelTask("T1")] * 2

    desk.hear(TaskUpdate("T1", TaskState.CANCELLED))
    desk.tick(after=REPEAT)
    assert len(desk.sent) == 2


def test_a_cancellation_of_a_task_that_left_the_list_is_not_repeated(desk):
    desk.queue = RequestQueue(desk.sent.append)
    desk.queue.cancel("T1")
    desk.hear(TaskList(1, 1, ()))
    desk.tick()

    assert desk.sent == []


def test_only_the_newest_answered_tasks_are_shown_and_no_open_one_is_dropped(desk):
    for number in range(2, MAX_SHOWN + 10):
        desk.queue.post(replace(TASK, id=f"T{number}"))
        desk.hear(TaskUpdate(f"T{number}", TaskState.WAITING))

    names = [sent.task.id for sent in desk.queue.sent_tasks]
    assert "T1" in names
    assert len(names) <= MAX_SHOWN + 1
    assert desk.queue.unanswered == 1


def test_a_zone_is_asked_for_again_until_the_traffic_planner_tells_that_it_is_so():
    desk, close = Desk(), ZoneCommand("door", closed=True)
    desk.queue.switch(close)
    desk.tick()
    desk.hear(TrafficState(1, 0.0, zones=("door", "hall"), closed=("hall",)))
    desk.tick(after=REPEAT)
    desk.hear(TrafficState(1, 0.0, zones=("door", "hall"), closed=("door", "hall")))
    desk.tick(after=REPEAT)

    assert desk.sent == [close, close]


def test_what_a_person_asks_for_a_zone_last_counts():
    desk, close, open_ = (
        Desk(),
        ZoneCommand("door", closed=True),
        ZoneCommand("door", closed=False),
    )
    desk.queue.switch(close)
    desk.queue.switch(open_)
    desk.tick()

    assert desk.sent == [open_]
