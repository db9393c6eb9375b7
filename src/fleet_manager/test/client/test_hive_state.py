# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

from dataclasses import replace

import pytest

from blackboard.auction.decision import Decision
from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.costing.bid_basis import Bids
from blackboard.domain.bid import MAX_COST, Bid
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskRecord, TaskUpdate
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.client import hive_state
from fleet_manager.client.hive_state import MAX_AT_ONCE, MAX_REMEMBERED, ROBOT_SILENCE, HiveState
from fleet_manager.client.leadership import FROZEN, SILENCE, Standing
from fleet_manager.client.words import Severity
from hive_common.pose import Pose

TASK = Task("T1", TaskType.GAB, (Pose(1, 2), Pose(3, 4)))
WAITING = TaskRecord(TASK)
ROBOT = RobotStatus("robot1", RobotState.IDLE, Pose(1, 2), 0.8)


class Desk:
    """The hive's state in a window, with one clock for both times."""

    def __init__(self):
        self.hive = HiveState(detailed=True)
        self.hive_id = "hive1"
        self.time = 100.0
        self.version = 0
        self.progress = 0

    def hear(self, report, stamp=None):
        self.hive.take_in(report, self.time, self.time if stamp is None else stamp)

    def hear_list(self, *records, epoch=1, stamp=None):
        self.version += 1
        self.hear(TaskList(epoch, self.version, records, self.hive_id), stamp)

    def beat(self, leader="blackboard", epoch=1, backup=""):
        self.progress += 1
        members = (leader,)
        self.hear(Heartbeat(epoch, leader, backup, members, self.progress, hive=self.hive_id))

    def wait(self, seconds):
        self.time += seconds
        self.hive.tick(self.time)

    def log(self):
        return [event.text for event in self.hive.take_changes().events]

    def bootstrap_anew(self):
        """Let another hive take the place of this one, with counters of its own."""
        self.hive_id = "hive2"
        self.progress = self.version = 0

    def state(self, task_id="T1"):
        return self.hive.record(task_id).state


@pytest.fixture
def desk():
    desk = Desk()
    desk.beat()
    return desk


def test_the_task_list_becomes_rows_in_its_order(desk):
    other = TaskRecord(replace(TASK, id="T0"))
    desk.hear_list(WAITING, other)

    assert list(desk.hive.tasks) == ["T1", "T0"]
    assert desk.hive.take_changes().tasks == {"T1", "T0"}


def test_a_long_list_is_told_in_parts_and_in_its_order(desk):
    ids = [f"T{number}" for number in range(MAX_AT_ONCE + 3)]
    desk.hear_list(*(TaskRecord(replace(TASK, id=name)) for name in ids))

    assert desk.hive.take_changes().tasks == set(ids[:MAX_AT_ONCE])
    assert desk.hive.take_changes().tasks == set(ids[MAX_AT_ONCE:])
    assert not desk.hive.take_changes().tasks


def test_only_what_changed_is_said_to_have_changed(desk):
    other = TaskRecord(replace(TASK, id="T2"))
    desk.hear_list(WAITING, other)
    desk.hive.take_changes()
    desk.hear_list(replace(WAITING, state=TaskState.ASSIGNED, robot="robot1"), other)

    assert desk.hive.take_changes().tasks == {"T1"}


def test_an_older_list_that_comes_late_changes_nothing(desk):
    desk.hear_list(replace(WAITING, state=TaskState.DONE))
    desk.hear(TaskList(1, 0, (WAITING,), "hive1"))

    assert desk.state() is TaskState.DONE


def test_a_task_that_is_no_longer_listed_goes(desk):
    desk.hear_list(WAITING)
    desk.log()
    desk.hear_list()

    assert desk.hive.tasks == {}
    assert desk.log() == ["task T1 is no longer on the list"]


def test_a_task_that_has_ended_goes_without_a_word(desk):
    done = replace(WAITING, state=TaskState.DONE, robot="robot1")
    desk.hear_list(done)
    desk.log()
    desk.hear_list()
    desk.hear(done.told(1))

    assert desk.hive.tasks == {}
    assert desk.log() == []


def test_an_update_changes_a_task_before_the_next_list_does(desk):
    desk.hear_list(WAITING)
    desk.hear(TaskUpdate("T1", TaskState.STARTED, "robot2", step=1, steps=2, eta=30.0, epoch=1))

    row = desk.hive.tasks["T1"]
    assert (row.record.state, row.record.robot, row.progress) == (
        TaskState.STARTED,
        "robot2",
        0.5,
    )
    assert row.due == desk.time + 30.0


def test_a_prediction_that_is_repeated_does_not_move_and_a_new_one_does(desk):
    desk.hear_list(WAITING)
    update = TaskUpdate("T1", TaskState.STARTED, "robot2", steps=2, eta=60.0, epoch=1)
    told_at = desk.time
    desk.hear(update)
    due = [desk.hive.tasks["T1"].due]

    for later in (update, replace(update, step=1), replace(update, step=1, eta=50.0)):
        desk.wait(20.0)
        desk.hear(later)
        due.append(desk.hive.tasks["T1"].due)

    assert due == [told_at + 60.0] * 3 + [told_at + 60.0 + 50.0]


def test_a_prediction_of_as_long_for_another_assignment_is_a_new_one(desk):
    desk.hear_list(WAITING)
    update = TaskUpdate(
        "T1", TaskState.ASSIGNED, "robot2", steps=2, eta=60.0, epoch=1, assignment=1
    )
    desk.hear(update)
    desk.wait(20.0)
    desk.hear(replace(update, robot_id="robot1", assignment=2))

    assert desk.hive.tasks["T1"].due == desk.time + 60.0


def test_a_list_written_before_an_update_does_not_take_it_back(desk):
    desk.hear_list(WAITING)
    desk.hear(TaskUpdate("T1", TaskState.DONE, "robot1", step=2, steps=2, epoch=1), stamp=105.0)
    desk.hear_list(replace(WAITING, state=TaskState.STARTED, robot="robot1"), stamp=104.0)
    assert desk.state() is TaskState.DONE

    desk.hear_list(replace(WAITING, state=TaskState.WAITING), stamp=106.0)
    assert desk.state() is TaskState.WAITING


def test_a_list_written_before_a_task_was_taken_in_does_not_take_it_off(desk):
    desk.hear_list()
    desk.hear(TASK)
    desk.hear(TaskUpdate("T1", TaskState.ASSIGNED, "robot1", epoch=1), stamp=105.0)
    desk.log()
    desk.hear_list(stamp=104.0)
    assert desk.state() is TaskState.ASSIGNED
    assert desk.log() == []

    desk.hear_list(stamp=106.0)
    assert desk.hive.record("T1") is None


def test_a_robot_that_hands_a_task_back_no_longer_has_it(desk):
    desk.hear_list(replace(WAITING, state=TaskState.STARTED, robot="robot1"))
    desk.hear(TaskUpdate("T1", TaskState.WAITING, "robot1", epoch=1))

    assert desk.hive.record("T1").robot == ""


def test_a_refused_task_is_shown_with_its_reason_beside_the_list(desk):
    desk.hear(TASK)
    desk.hear(TaskUpdate("T1", TaskState.REJECTED, reason="goal A is in a wall", epoch=1))
    desk.hear_list()

    assert desk.hive.record("T1").reason == "goal A is in a wall"
    assert "task T1 was rejected: goal A is in a wall" in desk.log()


def test_the_refusal_of_a_second_task_of_the_same_id_leaves_the_first_as_it_is(desk):
    desk.hear_list(replace(WAITING, state=TaskState.STARTED, robot="robot1"))
    desk.hear(replace(TASK, priority=9))
    desk.hear(TaskUpdate("T1", TaskState.REJECTED, reason="T1 is taken", epoch=1))

    assert desk.state() is TaskState.STARTED


def test_a_refused_task_that_is_sent_again_and_taken_in_is_a_task_like_any_other(desk):
    desk.hear(TASK)
    desk.hear(TaskUpdate("T1", TaskState.REJECTED, reason="no", epoch=1))
    desk.hear_list(WAITING)

    assert desk.state() is TaskState.WAITING


def test_refused_tasks_do_not_pile_up_for_ever(desk):
    for number in range(MAX_REMEMBERED + 50):
        desk.hear(replace(TASK, id=f"T{number}"))
        desk.hear(TaskUpdate(f"T{number}", TaskState.REJECTED, reason="no", epoch=1))
    desk.hear_list()

    assert len(desk.hive.tasks) == MAX_REMEMBERED


def test_the_view_goes_on_through_a_takeover(desk):
    desk.hear_list(WAITING)
    desk.log()
    desk.wait(SILENCE)
    desk.beat("robot1", epoch=2)
    desk.version = 0
    desk.hear_list(replace(WAITING, state=TaskState.ASSIGNED, robot="robot1"), epoch=2)

    assert desk.state() is TaskState.ASSIGNED
    log = desk.log()
    assert "no leader: blackboard is silent" in log
    assert "robot1 is the leader, epoch 2" in log


def test_an_old_blackboard_that_wakes_up_is_not_listened_to(desk):
    desk.beat("robot1", epoch=2)
    desk.hear_list(replace(WAITING, state=TaskState.STARTED, robot="robot1"), epoch=2)
    desk.beat("blackboard", epoch=1)
    desk.hear_list(WAITING, epoch=1)
    desk.hear(TaskUpdate("T1", TaskState.FAILED, epoch=1))

    assert desk.hive.leadership.heartbeat.leader == "robot1"
    assert desk.state() is TaskState.STARTED


def test_a_blackboard_that_was_bootstrapped_anew_is_followed_after_a_silence(desk):
    desk.hear_list(WAITING)
    desk.hear_list(WAITING)
    desk.wait(SILENCE)
    desk.bootstrap_anew()
    desk.hear_list(TaskRecord(replace(TASK, id="T9")))
    desk.beat()

    assert list(desk.hive.tasks) == ["T9"]


def test_a_blackboard_that_was_bootstrapped_anew_at_once_is_followed_too(desk):
    for _version in range(3):
        desk.hear_list(WAITING)
        desk.beat()
    desk.bootstrap_anew()
    desk.hear_list(TaskRecord(replace(TASK, id="T9")))
    desk.beat()

    assert list(desk.hive.tasks) == ["T9"]


@pytest.mark.parametrize("listed", [(), (WAITING,)])
def test_the_clock_of_a_blackboard_that_was_bootstrapped_anew_may_be_set_back(desk, listed):
    desk.hear_list(WAITING)
    desk.hear(TaskUpdate("T1", TaskState.STARTED, "robot1", epoch=1))
    desk.wait(SILENCE)
    desk.bootstrap_anew()
    desk.hear_list(*listed, stamp=3.0)
    desk.beat()

    assert [row.record for row in desk.hive.tasks.values()] == list(listed)


def test_the_hive_has_a_blackboard_while_its_heart_beats():
    desk = Desk()
    assert desk.hive.leadership.standing(desk.time) is Standing.NOBODY

    desk.beat()
    assert desk.hive.leadership.standing(desk.time) is Standing.LEADER

    desk.wait(SILENCE)
    assert desk.hive.leadership.standing(desk.time) is Standing.SILENT


def test_a_heartbeat_without_progress_is_that_of_a_stuck_blackboard(desk):
    for _beat in range(int(FROZEN) + 1):
        desk.progress -= 1
        desk.beat()
        desk.wait(1.0)

    assert desk.hive.leadership.standing(desk.time) is Standing.STUCK
    assert "no leader: blackboard answers but does not work" in desk.log()


def test_a_robot_that_stops_reporting_is_offline_until_it_reports_again(desk):
    desk.hear(ROBOT)
    desk.wait(ROBOT_SILENCE + 1)
    assert desk.hive.robots["robot1"].state is RobotState.OFFLINE
    assert "robot1 is offline: not heard here for 6 s" in desk.log()

    desk.hear(ROBOT)
    assert desk.hive.robots["robot1"].state is RobotState.IDLE
    assert "robot1 is heard again and is ready" in desk.log()


def test_a_robot_that_dies_is_told_once_whoever_notices_first(desk):
    desk.hear(ROBOT)
    desk.log()
    offline = replace(ROBOT, state=RobotState.OFFLINE, reason="not heard for 4 s")
    beat = Heartbeat(1, "blackboard", "", ("blackboard",), offline=("robot1",), hive="hive1")

    for second in range(12):
        desk.hear(offline)
        desk.hear(replace(beat, progress=second))
        desk.wait(1.0)

    assert [line for line in desk.log() if "robot1" in line] == [
        "robot1 is offline: heard here, but not by the leader"
    ]


def test_a_robot_that_only_the_leader_does_not_hear_stays_offline_without_a_second_alarm(desk):
    desk.hear(ROBOT)
    desk.log()
    beat = Heartbeat(1, "blackboard", "", ("blackboard",), offline=("robot1",), hive="hive1")

    for second in range(9):
        desk.hear(replace(beat, progress=second))
        desk.hear(replace(ROBOT, state=RobotState.OFFLINE))
        desk.hear(replace(ROBOT, sent=float(second)))

    assert desk.hive.robots["robot1"].state is RobotState.OFFLINE
    assert desk.hive.robots["robot1"].reason == "heard here, but not by the leader"
    assert len([line for line in desk.log() if "robot1" in line]) == 1


def test_a_silent_robot_shows_the_tasks_that_the_leader_says_it_has(desk):
    desk.hear(replace(ROBOT, state=RobotState.BUSY, task_id="T1", tasks=("T1", "T2")))
    desk.wait(ROBOT_SILENCE + 1)

    desk.hear(replace(ROBOT, state=RobotState.OFFLINE, task_id="", tasks=()))

    assert desk.hive.robots["robot1"].status.task_id == ""


def test_a_robot_that_says_the_same_again_changes_nothing(desk):
    desk.hear(ROBOT)
    desk.hive.take_changes()
    desk.hear(ROBOT)

    assert desk.hive.take_changes().robots == set()


def test_bids_are_kept_by_task_cheapest_first_and_a_new_auction_replaces_the_old(desk):
    desk.hear(Bids("robot1", 1, 1, (Bid("robot1", "T1", 9.0),)))
    desk.hear(Bids("robot2", 1, 1, (Bid("robot2", "T1", 5.0),)))
    assert [bid.robot_id for bid in desk.hive.bid_book.bids("T1")] == ["robot2", "robot1"]

    desk.hear(Bids("robot1", 1, 2, (Bid("robot1", "T1", 3.0),)))
    desk.hear(Bids("robot2", 1, 1, (Bid("robot2", "T1", 1.0),)))
    assert [bid.cost for bid in desk.hive.bid_book.bids("T1")] == [3.0]


def test_bids_that_were_not_heard_are_those_that_were_recorded(desk):
    recorded = Decision("T1", 1, 2, 1, 0.0, "robot1", bids=(Bid("robot1", "T1", 4.0),))
    desk.hive.add_bids(recorded)
    assert [bid.cost for bid in desk.hive.bid_book.bids("T1")] == [4.0]
    assert desk.hive.take_changes().tasks == {"T1"}

    desk.hear(Bids("robot1", 1, 3, (Bid("robot1", "T1", 3.0),)))
    desk.hive.add_bids(recorded)
    assert [bid.cost for bid in desk.hive.bid_book.bids("T1")] == [3.0]


def test_the_log_tells_the_life_of_a_task_in_words(desk):
    desk.hear_list()
    desk.log()
    desk.hear(TASK)
    desk.hear(TaskUpdate("T1", TaskState.WAITING, epoch=1))
    cannot = Bid("robot3", "T1", MAX_COST, reason="carries at most 5 kg")
    for bid in (Bid("robot1", "T1", 12.34), Bid("robot2", "T1", 20.0), cannot):
        desk.hear(Bids(bid.robot_id, 1, 1, (bid,)))
    for state, step in (("ASSIGNED", 0), ("STARTED", 0), ("STARTED", 1), ("DONE", 2)):
        desk.hear(TaskUpdate("T1", TaskState[state], "robot1", step, 2, epoch=1))

    assert desk.log() == [
        "task T1 was posted: GAB (1.0, 2.0) -> (3.0, 4.0), 0 kg, priority 0",
        "task T1 waits for a robot",
        "task T1 is on the list of robot1 at cost 12.3 (robot2 20.0, robot3 cannot)",
        "task T1 is under way by robot1, 0 of 2 steps done",
        "task T1 is under way by robot1, 1 of 2 steps done",
        "task T1 is done by robot1",
    ]


def test_a_start_that_overtakes_the_list_is_told_after_the_giving(desk):
    desk.hear_list(WAITING)
    desk.log()
    given = replace(WAITING, state=TaskState.ASSIGNED, robot="robot1")
    desk.hear(TaskUpdate("T1", TaskState.STARTED, "robot1", epoch=1), stamp=105.0)
    desk.hear_list(given, stamp=104.0)

    assert desk.log() == [
        "task T1 is on the list of robot1",
        "task T1 is under way by robot1, 0 of 2 steps done",
    ]


def test_a_start_that_was_never_heard_of_is_told_with_the_end(desk):
    given = replace(WAITING, state=TaskState.ASSIGNED, robot="robot1")
    desk.hear_list(given)
    desk.log()
    desk.hear(TaskUpdate("T1", TaskState.DONE, "robot1", 2, 2, epoch=1), stamp=105.0)

    assert desk.log() == [
        "task T1 is under way by robot1, 0 of 2 steps done",
        "task T1 is done by robot1",
    ]


def test_the_first_list_is_one_line_in_the_log_and_not_one_for_each_task(desk):
    desk.log()
    done = TaskRecord(replace(TASK, id="T2"), TaskState.DONE)
    desk.hear_list(WAITING, done)

    assert desk.log() == ["2 tasks on the list, 1 open"]


def test_a_task_nobody_can_do_says_why_it_waits_once(desk):
    desk.hear_list(WAITING)
    desk.log()
    waits = replace(WAITING, reason="no robot lifts 90 kg")
    desk.hear_list(waits)
    desk.hear_list(waits)

    assert desk.log() == ["task T1 waits for a robot: no robot lifts 90 kg"]


def test_the_log_tells_when_a_robot_goes_out_of_service_and_why(desk):
    desk.hear(ROBOT)
    desk.log()
    desk.hear(replace(ROBOT, state=RobotState.DEFECT, reason="an operator said so"))

    assert desk.log() == ["robot1 is out of service: an operator said so"]


def test_what_needs_a_person_is_told_with_its_severity(desk):
    desk.hear_list(WAITING)
    desk.hear(ROBOT)
    desk.hive.take_changes()
    desk.hear_list(replace(WAITING, state=TaskState.STARTED, robot="robot1"))
    desk.hear(TaskUpdate("T1", TaskState.WAITING, "robot1", epoch=1))
    desk.hear(TaskUpdate("T1", TaskState.FAILED, epoch=1, reason="no way to A"))
    desk.hear(replace(ROBOT, state=RobotState.DEFECT))

    assert [event.severity for event in desk.hive.take_changes().events[-3:]] == [
        Severity.WARNING,
        Severity.ALARM,
        Severity.ALARM,
    ]


def test_how_a_task_ended_is_known_after_it_has_left_the_list():
    state = HiveState()
    done = TaskRecord(TASK, TaskState.DONE, "robot1", 2)
    state.take_in(TaskList(1, 1, (done,)))
    state.take_in(TaskList(1, 2, ()))

    assert state.tasks == {}
    assert state.state_of("T1") is TaskState.DONE


def test_a_task_that_has_ended_does_not_come_back_by_a_late_update():
    state = HiveState()
    state.take_in(TaskList(1, 1, (TaskRecord(TASK, TaskState.DONE),)))

    state.take_in(TaskUpdate("T1", TaskState.STARTED, "robot2"))

    assert state.state_of("T1") is TaskState.DONE


def test_the_last_words_on_tasks_that_are_on_no_list_do_not_grow_for_ever(monkeypatch):
    monkeypatch.setattr(hive_state, "MAX_ANSWERS", 2)
    state = HiveState()
    for number in range(3):
        state.take_in(TaskUpdate(f"T{number}", TaskState.REJECTED))

    assert [state.last_word(f"T{number}") is None for number in range(3)] == [True, False, False]


def test_refused_tasks_are_not_among_the_records_of_the_list(desk):
    desk.hear(TASK)
    desk.hear(TaskUpdate("T1", TaskState.REJECTED, reason="no", epoch=1))

    assert list(desk.hive.tasks) == ["T1"]
    assert desk.hive.records == {}
