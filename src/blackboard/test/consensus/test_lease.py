# SPDX-License-Identifier: BSD-3-Clause
"""Leases on both sides, deadlines, and the recovery of a lost robot's tasks."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from blackboard.board.deadlines import Deadlines
from blackboard.board.recovery import after_loss, put_back
from blackboard.consensus.lease import Lease, Leases
from blackboard.consensus.messages import Heartbeat
from blackboard.domain.record import TaskRecord, TaskUpdate
from blackboard.domain.settings import MAX_DRIFT, BlackboardSettings
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.errors import SettingsError
from hive_common.pose import Pose

A, B = Pose(1.0, 1.0), Pose(3.0, 3.0)
CARRY = Task("T1", TaskType.GPAB, (A, B), payload=2.0)
ROUND = Task("T2", TaskType.GAB, (A, B), priority=3)
URGENT = replace(ROUND, priority=8)
WAITING, ASSIGNED, STARTED, DONE, _, CANCELLED, FAILED = TaskState


def beat(sent, epoch=1, robot="robot1", robot_lease=3.5):
    return Heartbeat(epoch, "blackboard", heard={robot: sent}, robot_lease=robot_lease)


def started(task, step=0, **fields):
    return TaskRecord(task, STARTED, robot="robot1", step=step, assignment=1, **fields)


def lost(record, policy="reassign", max_tries=5):
    return after_loss(record, policy, "last seen at (1.00, 2.00)", max_tries)


def test_a_robot_without_an_echo_may_not_work():
    assert not Lease("robot1", now=0.0).holds(0.0)


def test_a_lease_runs_from_the_time_of_sending_and_not_from_that_of_the_echo():
    lease = Lease("robot1", now=0.0)

    assert lease.renew(beat(sent=10.0), now=12.0)
    assert lease.holds(13.4)
    assert not lease.holds(13.5)
    assert lease.remaining(12.0) == pytest.approx(1.5)


def test_the_same_echo_again_renews_nothing():
    lease = Lease("robot1", now=0.0)
    lease.renew(beat(sent=10.0), now=10.1)

    assert not lease.renew(beat(sent=10.0), now=12.0)
    assert not lease.holds(13.5)


def test_an_older_echo_that_comes_late_shortens_nothing():
    lease = Lease("robot1", now=0.0)
    lease.renew(beat(sent=10.0), now=10.1)

    assert not lease.renew(beat(sent=9.0), now=10.2)
    assert lease.holds(13.4)


def test_the_echo_of_another_robot_renews_nothing():
    lease = Lease("robot1", now=0.0)

    assert not lease.renew(beat(sent=10.0, robot="robot2"), now=10.1)


@pytest.mark.parametrize("sent", [4.9, 10.2])
def test_an_echo_from_an_earlier_life_or_from_the_future_renews_nothing(sent):
    lease = Lease("robot1", now=5.0)

    assert not lease.renew(beat(sent), now=10.1)


def test_a_blackboard_of_a_lower_epoch_renews_nothing():
    lease = Lease("robot1", now=0.0)
    lease.renew(beat(sent=1.0, epoch=2), now=1.1)

    assert not lease.renew(beat(sent=2.0, epoch=1), now=2.1)
    assert lease.renew(beat(sent=2.0, epoch=2), now=2.1)


def test_a_robot_that_joins_another_hive_starts_a_new_lease():
    lease = Lease("robot1", now=0.0)
    lease.renew(beat(sent=1.0, epoch=7), now=1.1)
    lease.begin_anew(now=2.0)

    assert not lease.holds(2.0)
    assert not lease.renew(beat(sent=1.5), now=2.1)
    assert lease.renew(beat(sent=2.5), now=2.6)


def test_an_order_older_than_a_lease_or_than_the_robots_process_is_void():
    lease = Lease("robot1", now=5.0)
    lease.renew(beat(sent=10.0), now=10.1)

    assert lease.covers(heard=8.0, now=11.4)
    assert not lease.covers(heard=8.0, now=11.5)
    assert not lease.covers(heard=4.9, now=8.0)
    assert not lease.covers(heard=12.0, now=11.0)


def test_an_order_may_be_the_first_message_a_robot_hears():
    assert Lease("robot1", now=5.0).covers(heard=5.0, now=5.1)


def test_a_lease_knows_whether_a_recent_status_was_echoed():
    lease = Lease("robot1", now=0.0)
    never = lease.is_echoed_within(1.5, 0.0)
    lease.renew(beat(sent=10.0), now=10.1)

    assert not never
    assert lease.is_echoed_within(1.5, 11.4)
    assert not lease.is_echoed_within(1.5, 11.6)


def test_a_robot_is_lost_when_its_last_echoed_status_is_old_enough():
    leases = Leases(reassign=5.0, since=0.0)
    leases.grant("robot1", now=10.0)

    assert not leases.is_lost("robot1", 15.0)
    assert leases.is_lost("robot1", 15.1)


def test_a_new_blackboard_counts_from_its_own_start():
    leases = Leases(reassign=5.0, since=100.0)

    assert not leases.is_lost("robot1", 105.0)
    assert leases.is_lost("robot1", 105.1)


@given(
    sent=st.floats(0.0, 100.0),
    under_way=st.floats(0.0, 3.0),
    robot_rate=st.floats(1 - MAX_DRIFT, 1 + MAX_DRIFT),
    rate=st.floats(1 - MAX_DRIFT, 1 + MAX_DRIFT),
    robot_lease=st.floats(0.5, 20.0),
    margin=st.floats(0.1, 1.0),
    more=st.floats(0.001, 5.0),
)
def test_a_robot_has_stopped_before_it_is_lost_whatever_the_clocks(
    sent, under_way, robot_rate, rate, robot_lease, margin, more
):
    settings = BlackboardSettings(
        robot_lease=robot_lease,
        lease_margin=margin,
        reassign=1.02 * robot_lease + margin + more,
    )
    lease, leases = Lease("robot1", now=0.0), Leases(settings.reassign, since=0.0)
    heard = sent + under_way
    leases.grant("robot1", heard * rate)
    lease.renew(beat(sent * robot_rate, robot_lease=robot_lease), heard * robot_rate)
    stopped = sent + robot_lease / robot_rate

    assert not lease.holds(stopped * robot_rate + 1e-9)
    assert not leases.is_lost("robot1", stopped * rate)


@pytest.mark.parametrize("changes", [{"reassign": 4.0}, {"robot_lease": 5.0}, {"lease_margin": 3}])
def test_settings_that_might_not_stop_a_robot_in_time_are_refused_by_name(changes):
    with pytest.raises(SettingsError, match=r"reassign is .* above robot_lease .* lease_margin"):
        BlackboardSettings(**changes)


def test_an_unknown_policy_is_refused_with_the_allowed_ones():
    with pytest.raises(SettingsError, match="'hope'; allowed: reassign, wait, operator"):
        BlackboardSettings(on_robot_lost="hope")


def test_the_rest_of_a_lost_robots_task_is_for_another():
    after = lost(started(ROUND, step=1))

    assert (after.state, after.robot, after.step) == (WAITING, "", 1)
    assert after.tried == ("robot1",)
    assert after.reason == "robot1 is lost, last seen at (1.00, 2.00)"


def test_a_robot_lost_before_picking_leaves_the_whole_task():
    after = lost(started(CARRY, step=0))

    assert (after.state, after.step) == (WAITING, 0)


@pytest.mark.parametrize("policy", ["reassign", "wait", "operator"])
@pytest.mark.parametrize("step", [1, 2, 3])
def test_a_load_that_may_be_on_a_lost_robot_needs_a_person(step, policy):
    after = lost(started(CARRY, step=step), policy)

    assert (after.state, after.robot) == (FAILED, "robot1")
    assert "last seen at (1.00, 2.00); the load of 2 kg may be on board" in after.reason


def test_a_load_of_unknown_weight_is_a_load_as_well():
    assert lost(started(replace(CARRY, payload=0.0), step=2)).state is FAILED


def test_the_reason_mentions_what_people_have_loaded():
    after = lost(started(replace(ROUND, payload=7.0)))

    assert after.state is WAITING
    assert "bring what was loaded on it (7 kg) to the next robot" in after.reason


def test_a_task_that_had_not_begun_has_not_failed():
    queued = replace(started(ROUND), state=ASSIGNED)

    assert lost(queued).tried == ()
    assert lost(queued).state is WAITING


def test_a_task_with_which_robots_keep_getting_lost_fails():
    after = lost(started(ROUND, tried=("robot2", "robot3")), max_tries=3)

    assert after.state is FAILED
    assert after.reason.startswith("given up after 3 tries, the last: robot1 is lost")


def test_with_wait_the_task_keeps_its_robot_and_says_so():
    after = lost(started(ROUND, step=1), "wait")

    assert (after.state, after.robot, after.step) == (STARTED, "robot1", 1)
    assert after.reason.startswith("waits for robot1 to come back")


def test_with_operator_the_task_needs_a_person():
    after = lost(replace(started(ROUND), state=ASSIGNED), "operator")

    assert after.state is FAILED
    assert "look how far it has come" in after.reason


def test_a_task_handed_back_for_a_more_urgent_one_has_not_failed():
    update = TaskUpdate("T2", WAITING, "robot1", step=1, reason="put off", put_off_for="T9")
    after = put_back(started(ROUND, step=1), update, max_tries=1)

    assert (after.state, after.robot, after.step, after.tried) == (WAITING, "", 1, ())


def test_a_robot_cannot_have_done_more_steps_than_the_task_has():
    update = TaskUpdate("T2", WAITING, "robot1", step=200)

    assert put_back(started(ROUND), update, max_tries=5).step == 2


def overdue(deadlines, *records, now):
    return [(record.task.id, allowed) for record, allowed in deadlines.overdue(records, now)]


def test_a_robot_is_overdue_after_a_multiple_of_its_prediction_and_a_grace():
    deadlines = Deadlines(factor=2.0, grace=60.0)
    record = started(ROUND, eta=20.0)
    overdue(deadlines, record, now=1000.0)

    assert not overdue(deadlines, record, now=1100.0)
    assert overdue(deadlines, record, now=1100.1) == [("T2", 100.0)]


def test_a_step_renews_the_deadline():
    deadlines = Deadlines(2.0, 60.0)
    overdue(deadlines, started(ROUND, eta=20.0), now=0.0)
    overdue(deadlines, started(ROUND, step=1, eta=10.0), now=90.0)

    assert not overdue(deadlines, started(ROUND, step=1, eta=10.0), now=169.0)
    assert overdue(deadlines, started(ROUND, step=1, eta=10.0), now=171.0)


@pytest.mark.parametrize(("task", "allowed"), [(URGENT, 70.0), (ROUND, 260.0)])
def test_from_priority_8_on_every_step_has_a_deadline(task, allowed):
    deadlines = Deadlines(2.0, 60.0)
    record = started(task, eta=100.0, step_eta=5.0)
    overdue(deadlines, record, now=0.0)

    assert not overdue(deadlines, record, now=allowed - 0.1)
    assert overdue(deadlines, record, now=allowed + 0.1) == [("T2", allowed)]


@pytest.mark.parametrize(("task", "allowed"), [(URGENT, 118.0), (ROUND, 276.0)])
def test_the_margin_counts_twice_too_and_a_quarter_of_the_time_has_half_of_it(task, allowed):
    deadlines = Deadlines(2.0, 60.0)
    record = started(task, eta=100.0, step_eta=25.0, eta_margin=8.0)
    overdue(deadlines, record, now=0.0)

    assert not overdue(deadlines, record, now=allowed - 0.1)
    assert overdue(deadlines, record, now=allowed + 0.1) == [("T2", pytest.approx(allowed))]


def test_a_robot_that_predicts_nothing_is_never_overdue():
    deadlines = Deadlines(2.0, 60.0)
    overdue(deadlines, started(ROUND), now=0.0)

    assert not overdue(deadlines, started(ROUND), now=1e6)


def test_a_queued_task_gets_a_new_deadline_when_its_robot_advances_with_another_task():
    deadlines = Deadlines(2.0, 60.0)
    queued = TaskRecord(CARRY, ASSIGNED, robot="robot1", assignment=1, eta=20.0)
    overdue(deadlines, queued, started(ROUND, eta=500.0), now=0.0)
    overdue(deadlines, queued, started(ROUND, step=1, eta=500.0), now=90.0)

    assert not overdue(deadlines, queued, started(ROUND, step=1, eta=500.0), now=189.0)
    late = overdue(deadlines, queued, started(ROUND, step=1, eta=500.0), now=191.0)
    assert late == [("T1", 100.0)]


def test_another_assignment_has_another_deadline():
    deadlines = Deadlines(2.0, 60.0)
    record = TaskRecord(CARRY, ASSIGNED, robot="robot1", assignment=1, eta=20.0)
    overdue(deadlines, record, now=0.0)

    again = replace(record, assignment=2)
    assert not overdue(deadlines, again, now=101.0)
