# SPDX-License-Identifier: BSD-3-Clause
"""What needs a person, in the line at the top of the windows."""

from dataclasses import replace

import pytest

from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import MOVES_ON, TOLD_TO, TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.client.attention import needs
from fleet_manager.client.hive_state import PLANNER_SILENCE, HiveState
from fleet_manager.client.traffic import TrafficState
from hive_common.map_id import MapId
from hive_common.pose import Pose

NOW = 1000.0
WAITS = TaskRecord(Task("T1", TaskType.GA, (Pose(1, 2),), posted=NOW - 5.0))
STARTED = replace(WAITS, state=TaskState.STARTED, robot="robot1", eta=20.0, predicted_at=NOW - 40)


def told(*reports, now=NOW):
    state = HiveState()
    for report in reports:
        state.take_in(report, 0.0, NOW)
    return [text for text, _ in needs(state, now)]


def listed(*records):
    return TaskList(1, 1, records)


def robot(number, state):
    return RobotStatus(f"robot{number}", state, Pose(0, 0), 1.0)


def test_a_hive_that_is_well_needs_nobody():
    going = replace(STARTED, predicted_at=NOW - 5)
    done = replace(STARTED, task=replace(STARTED.task, id="T2"), state=TaskState.DONE)

    assert (
        told(robot(1, RobotState.BUSY), robot(2, RobotState.CHARGING), listed(going, done)) == []
    )


def test_robots_that_are_offline_or_defect_are_named_and_many_are_counted():
    robots = [robot(n, RobotState.DEFECT) for n in (10, 2, 3, 4, 5)]

    assert told(robot(1, RobotState.OFFLINE), *robots) == [
        "robot1 offline",
        "robot2, robot3, robot4 and 2 other robots defect",
    ]


def test_robots_on_another_map_than_the_leader_are_named_unless_they_are_offline():
    hall, shelf = MapId("hall", "01"), MapId("shelf", "02")
    lost = robot(4, RobotState.OFFLINE)
    robots = [robot(1, RobotState.IDLE), robot(2, RobotState.BUSY), robot(3, RobotState.IDLE)]
    beat = Heartbeat(1, "/blackboard", map=hall)

    told_of = told(
        beat,
        replace(robots[0], map=hall),
        replace(robots[1], map=shelf),
        robots[2],
        replace(lost, map=shelf),
    )
    two = told(beat, *(replace(each, map=shelf) for each in robots[:2]))

    assert told_of == ["robot4 offline", "robot2 uses another map than the leader"]
    assert two == ["robot1, robot2 use other maps than the leader"]


@pytest.mark.parametrize(
    ("record", "words"),
    [
        (WAITS, []),
        (replace(WAITS, reason="too heavy"), ["T1 waits: too heavy"]),
        (replace(WAITS, reason=f"robot1 {TOLD_TO}"), []),
        (replace(WAITS, reason=f"robot1 has handed it back: {MOVES_ON}"), []),
        (
            replace(WAITS, task=replace(WAITS.task, posted=NOW - 90.0)),
            ["T1 waits: no robot has taken it for 1 min 30 s"],
        ),
        (replace(WAITS, task=replace(WAITS.task, posted=0.0)), []),
        (replace(WAITS, task=replace(WAITS.task, posted=NOW + 500.0)), []),
    ],
)
def test_a_task_that_waits_is_told_with_why_or_after_long(record, words):
    assert told(listed(record)) == words


def test_of_several_tasks_that_wait_the_first_says_why():
    first = replace(WAITS, reason="too heavy")
    others = [replace(first, task=replace(first.task, id=f"T{n}")) for n in (2, 3)]

    assert told(listed(first, *others)) == ["T1, and 2 other tasks wait: too heavy"]


def test_a_task_that_takes_longer_than_predicted_is_late():
    queued = replace(STARTED, task=replace(STARTED.task, id="T2"), state=TaskState.ASSIGNED)

    assert told(listed(STARTED, queued)) == ["T1 late"]


def test_closed_zones_and_a_silent_planner_are_told():
    state = HiveState()
    state.take_in(TrafficState(1, 1.0, zones=("door", "hall"), closed=("door",)), 0.0, NOW)
    assert [text for text, _ in needs(state, NOW)] == ["closed: door"]

    state.tick(PLANNER_SILENCE + 1)
    assert [text for text, _ in needs(state, NOW)] == [
        "the traffic planner is silent: robots drive by right of way"
    ]
