# SPDX-License-Identifier: BSD-3-Clause
"""What an event leaves of a record."""

from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskEvent, TaskState, TaskType
from hive_common.pose import Pose

TASK = Task("T1", TaskType.GPAB, (Pose(1.0, 2.0), Pose(3.0, 2.0)), payload=1.0)


def test_a_new_record_waits_for_its_first_robot():
    record = TaskRecord(TASK)

    assert record.state is TaskState.WAITING
    assert (record.robot, record.step, record.assignment) == ("", 0, 0)


def test_a_record_knows_its_number_of_steps():
    assert TaskRecord(TASK).steps == 4


def test_an_event_changes_the_state_and_what_it_brings_and_nothing_else():
    before = TaskRecord(TASK, parent="T", reason="why", tried=("robot2",))

    after = before.after(TaskEvent.ASSIGN, robot="robot1", assignment=1, eta=5.0)

    assert after == TaskRecord(
        TASK,
        TaskState.ASSIGNED,
        robot="robot1",
        eta=5.0,
        reason="why",
        parent="T",
        assignment=1,
        tried=("robot2",),
    )
    assert before.state is TaskState.WAITING


def test_an_event_that_changes_nothing_gives_no_record():
    done = TaskRecord(TASK, TaskState.DONE, robot="robot1")

    assert done.after(TaskEvent.CANCEL, reason="too late") is None
