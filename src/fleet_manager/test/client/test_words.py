# SPDX-License-Identifier: BSD-3-Clause
from dataclasses import replace

import pytest

from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.domain.bid import Bid
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import MOVES_ON, TOLD_TO, TaskRecord, TaskUpdate
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.client.hive_state import HiveState
from fleet_manager.client.rows import RobotRow, TaskRow
from fleet_manager.client.tables import (
    age,
    fit,
    reason,
    robot_data,
    robots_table,
    task_data,
    tasks_table,
    who_leads,
)
from fleet_manager.client.words import Severity, task_change
from hive_common.pose import Pose

TASK = Task("T1", TaskType.GAB, (Pose(1.0, 2.0), Pose(3.0, 4.0)), priority=5, payload=20.0)
ROBOT = RobotStatus("robot1", RobotState.BUSY, Pose(1.0, 2.0), 0.5, 0.0, "T1", tasks=("T1", "T2"))


def told(state, *reports):
    """Return what is told about reports that come one after the other."""
    state.take_changes()
    for report in reports:
        state.take_in(report)
    return [event.text for event in state.take_changes().events]


def test_an_older_list_changes_nothing_however_late_it_comes():
    state = HiveState()
    newer = TaskList(2, 1, (TaskRecord(TASK, TaskState.DONE, "robot1"),))
    older = TaskList(1, 9, (TaskRecord(TASK),))
    state.take_in(newer)

    assert told(state, older) == []
    assert state.state_of("T1") is TaskState.DONE


def test_a_hive_that_was_bootstrapped_anew_begins_with_a_list_and_epochs_of_its_own():
    state = HiveState()
    state.take_in(TaskList(7, 30, (TaskRecord(TASK, TaskState.DONE, "robot1"),), "hive1"))
    state.take_in(Heartbeat(7, "/robot1", hive="hive1"))

    state.take_in(TaskList(1, 2, (), "hive2"))
    state.take_in(Heartbeat(1, "/blackboard", hive="hive2"))

    assert state.tasks == {}
    assert state.heartbeat.leader == "/blackboard"


def test_an_update_makes_the_list_newer():
    state = HiveState()
    state.take_in(TaskList(1, 1, (TaskRecord(TASK),)))

    state.take_in(TaskUpdate("T1", TaskState.STARTED, "robot2", step=1, steps=2, eta=9.0))

    record = state.record("T1")
    assert (record.state, record.robot, record.step, record.eta) == (
        TaskState.STARTED, "robot2", 1, 9.0,
    )  # fmt: skip


def test_the_blackboards_word_that_comes_after_the_robots_own_changes_nothing():
    state = HiveState()
    state.take_in(TaskList(1, 1, (TaskRecord(TASK),)))
    started = TaskUpdate("T1", TaskState.STARTED, "robot2", assignment=2)
    assigned = TaskUpdate("T1", TaskState.ASSIGNED, "robot2", assignment=2)
    lost_before = TaskUpdate("T1", TaskState.WAITING, assignment=1)
    lost_since = TaskUpdate("T1", TaskState.WAITING, assignment=2)

    assert told(state, started, assigned, lost_before) == [
        "task T1 is under way by robot2, 0 of 2 steps done"
    ]
    assert (
        told(
            state, TaskList(1, 2, (TaskRecord(TASK, TaskState.ASSIGNED, "robot2", assignment=2),))
        )
        == []
    )
    assert told(state, lost_since) == ["task T1 waits for a robot"]


def test_a_heartbeat_of_an_older_epoch_does_not_count():
    state = HiveState()
    state.take_in(Heartbeat(3, "/robot1"))

    state.take_in(Heartbeat(2, "/blackboard"))

    assert state.heartbeat.leader == "/robot1"
    assert who_leads(state, 0.0, 0.0) == "robot1 is the leader (epoch 3), nobody its backup"


def test_the_life_of_a_task_is_told_in_words_and_each_thing_once():
    waiting = TaskUpdate("T1", TaskState.WAITING, steps=2)
    assigned = TaskUpdate("T1", TaskState.ASSIGNED, "robot1", steps=2)
    started = TaskUpdate("T1", TaskState.STARTED, "robot1", step=1, steps=2)
    done = TaskUpdate("T1", TaskState.DONE, "robot1", step=2, steps=2)

    said = told(
        HiveState(), waiting, waiting, TaskList(1, 1, (TaskRecord(TASK),)), assigned, started,
        started, done, TaskList(1, 2, (TaskRecord(TASK, TaskState.DONE, "robot1", 2),)), started,
    )  # fmt: skip

    assert said == [
        "task T1 waits for a robot",
        "task T1 is on the list of robot1",
        "task T1 is under way by robot1, 1 of 2 steps done",
        "task T1 is done by robot1",
    ]


def test_a_rejection_tells_its_reason():
    update = TaskUpdate("T1", TaskState.REJECTED, reason="goal A is inside a wall")

    assert told(HiveState(), update) == ["task T1 was rejected: goal A is inside a wall"]


def test_robots_and_the_blackboard_are_told_when_they_change():
    defect = RobotStatus("robot1", RobotState.DEFECT, Pose(1, 2), 0.5, reason="set by an operator")

    said = told(
        HiveState(), ROBOT, ROBOT, defect,
        Heartbeat(1, "/blackboard"), Heartbeat(1, "/blackboard"),
        Heartbeat(2, "/robot2", "/robot1", ("/robot1", "/robot2")),
    )  # fmt: skip

    assert said == [
        "robot1 is at work, battery 50%",
        "robot1 is out of service: set by an operator",
        "blackboard is the leader, epoch 1",
        "robot2 is the leader, epoch 2",
        "robot1 is the backup",
        "robot1 joined the hive",
        "robot2 joined the hive",
    ]


def test_tables_have_aligned_columns_with_units():
    other = TaskRecord(Task("longer-id", TaskType.GA, (Pose(0, 0),)), TaskState.DONE, "robot1", 1)

    going = TaskRecord(TASK, TaskState.STARTED, "robot1", 1, 12.4, predicted_at=100.0)

    lines = tasks_table([TaskRow(going), TaskRow(other)], 100.0, {})

    assert lines[1].split() == [
        "T1", "GAB", "5", "20", "kg", "STARTED", "robot1", "1/2", "12", "s",
    ]  # fmt: skip
    assert (
        len({line.index(word) for line, word in zip(lines, ["TYPE", "GAB", "GA"], strict=True)})
        == 1
    )


def test_a_robots_queue_is_what_stands_behind_its_current_task():
    row = RobotRow(ROBOT, 0.0)

    assert robots_table([row])[1].split()[-1] == "1"
    assert robot_data(row)["queued"] == 1


def test_an_empty_table_is_its_headings():
    assert len(tasks_table([], 0.0, {})) == 1


def test_task_data_is_plain_and_complete():
    record = TaskRecord(TASK, TaskState.WAITING, reason="no robot is in service")

    data = task_data(TaskRow(record), 0.0)

    assert data["type"] == "GAB"
    assert data["goals"][1] == {"x": 3.0, "y": 4.0, "yaw": 0.0}
    assert (data["state"], data["steps"]) == ("WAITING", 2)


@pytest.mark.parametrize(("now", "eta"), [(1000.0, 35.0), (1050.0, -15.0), (0.0, 0.0)])
def test_the_time_left_in_task_data_counts_down_and_is_0_where_the_clock_is_unknown(now, eta):
    record = TaskRecord(TASK, TaskState.STARTED, "robot1", eta=30.0, predicted_at=1005.0)

    assert task_data(TaskRow(record), now)["eta"] == eta


def test_lines_that_are_too_wide_are_cut_with_an_ellipsis():
    assert fit(["short", "much longer"], 6) == ["short", "much …"]


def test_how_a_task_ended_is_known_after_it_has_left_the_list():
    state = HiveState()
    done = TaskRecord(TASK, TaskState.DONE, "robot1", 2)
    state.take_in(TaskList(1, 1, (done,)))

    assert told(state, TaskList(1, 2, ()), done.told(1)) == []
    assert state.tasks == {}
    assert state.state_of("T1") is TaskState.DONE


def test_a_task_that_is_posted_anew_is_another_one():
    state = HiveState()
    state.take_in(TaskList(1, 1, (TaskRecord(TASK, TaskState.DONE, "robot1", 2),)))
    state.take_in(TaskList(1, 2, ()))

    said = told(state, TaskList(1, 3, (TaskRecord.new(TASK, 1),)))

    assert said == ["task T1 waits for a robot"]
    assert state.state_of("T1") is TaskState.WAITING


def test_a_repeated_rejection_is_told_once():
    update = TaskUpdate("T1", TaskState.REJECTED, reason="goal A is inside a wall")

    assert len(told(HiveState(), update, update)) == 1


def test_an_update_of_an_older_epoch_than_the_leaders_changes_nothing():
    state = HiveState()
    state.take_in(TaskList(2, 1, (TaskRecord(TASK),)))
    state.take_in(Heartbeat(2, "/robot1"))

    assert told(state, TaskUpdate("T1", TaskState.FAILED, epoch=1)) == []
    assert state.state_of("T1") is TaskState.WAITING


def test_a_task_that_a_plan_gives_to_another_robot_is_no_warning():
    held = TaskRecord(TASK, TaskState.ASSIGNED, "robot1", assignment=1)
    waits = replace(held, state=TaskState.WAITING, robot="")

    (planned,) = task_change(held, replace(waits, reason=f"handed back: {MOVES_ON}"))
    (told,) = task_change(held, replace(waits, reason=f"robot1 {TOLD_TO}"))
    (lost,) = task_change(held, replace(waits, reason="robot1 is lost"))

    assert {planned.severity, told.severity} == {Severity.NEWS}
    assert lost.severity is Severity.WARNING


def test_a_task_that_did_not_go_to_the_cheapest_says_where_the_reason_is():
    held = TaskRecord(TASK, TaskState.ASSIGNED, "robot1", assignment=1)
    bids = (Bid("robot2", "T1", 134.5), Bid("robot1", "T1", 159.0))

    (event,) = task_change(None, held, bids)

    assert event.text == (
        "task T1 is on the list of robot1 at cost 159.0 (robot2 134.5); "
        "`hive why T1` says why not to the cheapest"
    )


def test_a_task_whose_robot_stands_still_shows_why():
    row = TaskRow(TaskRecord(TASK, TaskState.STARTED, "robot1", reason="slow"))
    stands = RobotRow(ROBOT, 0.0, waits="waits for robot2 at the door")

    assert reason(row, {}) == "slow"
    assert reason(row, {"robot1": stands}) == "slow; robot1: waits for robot2 at the door"
    queued = TaskRow(TaskRecord(TASK, TaskState.ASSIGNED, "robot1"))
    assert reason(queued, {"robot1": stands}) == ""


@pytest.mark.parametrize(
    ("posted", "words"), [(0.0, "–"), (40.0, "1 min 00 s"), (500.0, "–"), (100.5, "0 s")]
)
def test_the_age_of_a_task_from_before_the_clock_was_set_back_is_not_known(posted, words):
    assert age(TaskRow(TaskRecord(replace(TASK, posted=posted))), 100.0) == words
