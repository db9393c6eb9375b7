# SPDX-License-Identifier: BSD-3-Clause
"""Which ended tasks are forgotten, and when."""

import pytest

from blackboard.board.retention import MAX_AT_ONCE, MIN_KEPT, Retention
from blackboard.consensus.log import Entry, Log, Position, Snapshot
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose

WAITING, _, STARTED, DONE, _, CANCELLED, FAILED = TaskState


def record(name, state=DONE, parent="", parts=0, assignment=1):
    task = Task(name, TaskType.GA, (Pose(1.0, 1.0),))
    return TaskRecord(task, state, parent=parent, parts=parts, assignment=assignment)


class Desk:
    """A log, committed unless said otherwise, and what of it is to be forgotten."""

    def __init__(self, *records, keep=60.0, most=500):
        self.log = Log.of(Snapshot(Position(1, 1)))
        self.retention = Retention(keep, most)
        self.write(*records)

    def write(self, *records, committed=True):
        self.log = self.log.append(Entry(1, self.log.position.version + 1, records))
        if committed:
            self.log = self.log.commit(self.log.position.version, kept=100)

    def due(self, now):
        return self.retention.due(self.log, now)


@pytest.mark.parametrize("state", [DONE, CANCELLED, FAILED])
def test_an_ended_task_is_forgotten_after_its_time(state):
    desk = Desk(record("T1", state))

    assert [desk.due(now) for now in (100.0, 159.9, 160.0)] == [(), (), ("T1",)]


@pytest.mark.parametrize("state", [WAITING, STARTED])
def test_a_task_that_has_not_ended_is_never_forgotten(state):
    desk = Desk(record("T1", state), keep=0.1, most=1)

    assert [desk.due(now) for now in (0.0, 1e9)] == [(), ()]


def test_the_time_counts_from_the_end_of_the_task():
    desk = Desk(record("T1", STARTED))
    desk.due(0.0)
    desk.write(record("T1"))
    desk.due(59.0)

    assert [desk.due(now) for now in (60.0, 119.0)] == [(), ("T1",)]


def test_a_new_leader_counts_from_its_own_election():
    desk = Desk(record("T1"))
    desk.due(0.0)
    desk.retention.begin()

    assert [desk.due(now) for now in (60.0, 119.0, 120.0)] == [(), (), ("T1",)]


def test_a_task_whose_end_is_not_committed_is_kept():
    desk = Desk()
    desk.write(record("T1"), committed=False)
    desk.due(0.0)
    assert desk.due(100.0) == ()

    desk.log = desk.log.commit(desk.log.position.version, kept=100)
    assert desk.due(100.0) == ("T1",)


def test_of_too_many_the_oldest_are_forgotten_first_but_not_at_once():
    desk = Desk(record("T1"), keep=3600.0, most=2)
    desk.due(0.0)
    desk.write(record("T2"), record("T3"), record("T4"))

    assert [desk.due(now) for now in (1.0, MIN_KEPT - 0.1)] == [(), ()]
    assert desk.due(MIN_KEPT + 1.0) == ("T1", "T2")


def test_a_task_that_was_split_is_forgotten_with_its_parts_when_all_have_ended():
    desk = Desk(
        record("T7", FAILED, parts=2),
        record("T7.1", FAILED, "T7", parts=1),
        record("T7.2", STARTED, "T7"),
        record("T7.1.1", FAILED, "T7.1"),
    )
    desk.due(0.0)
    assert desk.due(100.0) == ()

    desk.write(record("T7.2", DONE, "T7"))
    desk.due(100.0)
    assert desk.due(160.0) == ("T7", "T7.1", "T7.2", "T7.1.1")


def test_one_change_does_not_forget_more_than_a_message_may_hold():
    desk = Desk(*(record(f"T{number}") for number in range(MAX_AT_ONCE + 1)))
    desk.due(0.0)

    assert len(desk.due(60.0)) == MAX_AT_ONCE


def test_a_forgotten_task_leaves_the_list():
    desk = Desk(record("T1"), record("T2", STARTED), record("T3"))
    version = desk.log.position.version

    log = desk.log.append(Entry(1, version + 1, forgotten=("T1", "T3", "never there")))

    assert list(log.latest.records) == ["T2"]
    assert list(log.stable.records) == ["T1", "T2", "T3"]


def test_a_task_that_is_posted_anew_comes_last():
    desk = Desk(record("T1"), record("T2"))
    version = desk.log.position.version

    log = desk.log.append(Entry(1, version + 1, forgotten=("T1",)))
    log = log.append(Entry(1, version + 2, (record("T1", WAITING),)))

    assert list(log.latest.records) == ["T2", "T1"]


def test_assignment_numbers_continue_from_the_highest_forgotten():
    desk = Desk(record("T1", assignment=3), record("T2", assignment=5), record("T3", assignment=7))
    version = desk.log.position.version

    log = desk.log.append(Entry(1, version + 1, forgotten=("T2",)))
    log = log.append(Entry(1, version + 2, forgotten=("T1",)))
    anew = TaskRecord.new(record("T1").task, log.latest.earlier)

    assert (anew.assignment, anew.earlier, anew.times_assigned) == (5, 5, 0)
    assert [anew.is_once_held(number) for number in (0, 3, 5, 6)] == [False] * 4
