# SPDX-License-Identifier: BSD-3-Clause
"""What is refused on each topic before it reaches a handler, by kind of value."""

import math
from dataclasses import replace

import pytest

from blackboard.board.intake import why_refused
from blackboard.consensus.log import Entry, Position, Snapshot
from blackboard.consensus.messages import AppendEntries, AppendReply, Ballot, BallotKind, Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.domain.record import (
    ANY_ASSIGNMENT,
    Broadcast,
    Order,
    OrderKind,
    TaskRecord,
    TaskUpdate,
)
from blackboard.domain.talker import (
    BACKUP,
    BB_ACK,
    BB_ENTRIES,
    BB_VOTE,
    SYNC,
    TASK_ASSIGN,
    TASK_BROADCAST,
    TASK_STATE,
)
from blackboard.domain.task import Task, TaskState
from blackboard.domain.validation import MAX_COUNT, MAX_ITEMS
from hive_common.pose import Pose

GO = Task("T1", 0, (Pose(1.0, 2.0),))
RECORD = TaskRecord(GO, TaskState.ASSIGNED, "robot1", assignment=1)
ORDER = Order(GO, "robot1", epoch=1, assignment=1)
UPDATE = TaskUpdate("T1", TaskState.DONE, "robot1", assignment=1)
BEFORE = Position(1, 1)


def entries(*records, **fields):
    """Return a message of the leader with one entry."""
    sent = AppendEntries(1, "robot1#1", BEFORE, (Entry(1, 2, records),), 1, 5.0)
    return replace(sent, **fields)


VALID = [
    (BACKUP, Heartbeat(1, "robot1")),
    (BB_ACK, AppendReply("robot1#1", 1, 1, 5.0)),
    (BB_VOTE, Ballot(BallotKind.VOTE, 1, "robot1#1", "robot1#1", BEFORE)),
    (BB_ENTRIES, entries(RECORD, snapshot=Snapshot(BEFORE, {"T1": RECORD}, ("robot1#1",)))),
    (SYNC, TaskList(1, 1, (RECORD,))),
    (TASK_ASSIGN, ORDER),
    (TASK_BROADCAST, Broadcast(1, 1, ((GO, 0),), asked={"robot1": "T2"})),
    (TASK_STATE, UPDATE),
]


@pytest.mark.parametrize(("topic", "message"), VALID)
def test_a_valid_message_is_let_through(topic, message):
    assert why_refused(topic, message) == ""


TOO_MANY = [
    (BACKUP, Heartbeat(MAX_COUNT + 1, "robot1")),
    (BACKUP, Heartbeat(1, "robot1", version=2**32 - 1)),
    (BB_ACK, AppendReply("robot1#1", MAX_COUNT + 1, 1, 5.0)),
    (BB_VOTE, Ballot(BallotKind.VOTE, MAX_COUNT + 1, "a#1", "a#1", BEFORE)),
    (BB_VOTE, Ballot(BallotKind.VOTE, 1, "a#1", "a#1", Position(1, MAX_COUNT + 1))),
    (BB_ENTRIES, entries(epoch=MAX_COUNT + 1)),
    (BB_ENTRIES, entries(committed=MAX_COUNT + 1)),
    (BB_ENTRIES, entries(entries=(Entry(1, MAX_COUNT + 1),))),
    (BB_ENTRIES, entries(snapshot=Snapshot(BEFORE, earlier=MAX_COUNT + 1))),
    (BB_ENTRIES, entries(replace(RECORD, earlier=MAX_COUNT + 1))),
    (SYNC, TaskList(1, MAX_COUNT + 1, ())),
    (TASK_ASSIGN, replace(ORDER, epoch=MAX_COUNT + 1)),
    (TASK_ASSIGN, replace(ORDER, assignment=MAX_COUNT + 1)),
    (TASK_STATE, replace(UPDATE, assignment=MAX_COUNT + 1)),
    (TASK_BROADCAST, Broadcast(1, MAX_COUNT + 1, ())),
]


@pytest.mark.parametrize(("topic", "message"), TOO_MANY)
def test_what_no_hive_has_counted_to_is_refused(topic, message):
    # The next number might not fit into the field of a message; that would end whoever counts on.
    assert f"allowed: at most {MAX_COUNT}" in why_refused(topic, message)


@pytest.mark.parametrize("topic", [TASK_ASSIGN, TASK_STATE])
def test_the_number_that_stands_for_any_assignment_is_let_through(topic):
    forgotten = replace(ORDER, kind=OrderKind.FORGOTTEN, assignment=ANY_ASSIGNMENT)
    done = replace(UPDATE, assignment=ANY_ASSIGNMENT)

    assert why_refused(topic, forgotten if topic == TASK_ASSIGN else done) == ""


ODD_RECORDS = [
    (replace(RECORD, eta=math.nan), "TaskRecord.eta is nan"),
    (replace(RECORD, step_eta=1e300), "TaskRecord.step_eta is 1e+300"),
    (replace(RECORD, robot="x" * 257), "TaskRecord.robot has 257 characters"),
    (replace(RECORD, step=2), "step 2 of T1 is beyond its 1 steps"),
    (replace(RECORD, parts=3, step=4), "step 4 of T1 is beyond its 3 parts"),
    (replace(RECORD, parts=3, task=replace(GO, goals=())), "GA has 0 goals"),
    (replace(RECORD, task=replace(GO, posted=2.0**32)), "posted at 4294967296 s"),
]


@pytest.mark.parametrize(("record", "flaw"), ODD_RECORDS)
@pytest.mark.parametrize("topic", [BB_ENTRIES, SYNC])
def test_a_record_with_which_one_cannot_calculate_is_refused(topic, record, flaw):
    message = entries(record) if topic == BB_ENTRIES else TaskList(1, 1, (record,))

    assert flaw in why_refused(topic, message)


def test_a_record_of_a_snapshot_is_checked_too():
    odd = Snapshot(BEFORE, {"T1": replace(RECORD, eta=math.inf)}, ("robot1#1",))

    assert "TaskRecord.eta is inf" in why_refused(BB_ENTRIES, entries(snapshot=odd))


def test_the_reason_of_a_record_may_be_as_long_as_the_leader_made_it():
    assert why_refused(BB_ENTRIES, entries(replace(RECORD, reason="x" * 50_000))) == ""


def test_all_of_an_order_is_checked_whatever_it_asks():
    assert "Order.hive has 300" in why_refused(TASK_ASSIGN, replace(ORDER, hive="x" * 300))
    assert "Order.heard is nan" in why_refused(TASK_ASSIGN, replace(ORDER, heard=math.nan))


def test_a_call_for_bids_on_more_tasks_than_any_hive_has_is_refused():
    call = Broadcast(1, 1, ((GO, 0),) * (MAX_ITEMS + 1))

    assert why_refused(TASK_BROADCAST, call) == (
        f"Broadcast.tasks has {MAX_ITEMS + 1} items; allowed: at most {MAX_ITEMS}"
    )
    assert "has 300 characters" in why_refused(TASK_BROADCAST, Broadcast(1, 1, (), "x" * 300))
