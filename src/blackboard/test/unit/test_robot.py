# SPDX-License-Identifier: BSD-3-Clause
"""One robot that is told what to do by the test, in the blackboard's place."""

from dataclasses import replace

import pytest

from blackboard.backup import TaskList
from blackboard.battery import Battery
from blackboard.characteristics import RobotState
from blackboard.controller import CommandResult, CommandState, Controller
from blackboard.cost import MAX_COST
from blackboard.journal import MemoryJournal
from blackboard.pose import Pose
from blackboard.record import Broadcast, Order, TaskRecord
from blackboard.robot import Robot
from blackboard.settings import ControllerSettings, RobotSettings
from blackboard.talker import (
    ROBOT_STATUS,
    SYNC,
    TASK_ASSIGN,
    TASK_BROADCAST,
    TASK_COST,
    TASK_STATE,
)
from blackboard.task import StepKind, Task, TaskState, TaskType
from blackboard.testing import SMALL_ROBOT, Listener, Network, NetworkTalker, TimedCommand
from blackboard.ways import StraightWays

A, B = Pose(6.0, 0.0), Pose(12.0, 0.0)
GO = Task("T1", TaskType.GA, (A,))
CARRY = Task("T2", TaskType.GPAB, (A, B), payload=5.0)
ROUND = Task("T3", TaskType.GAB, (A, B), payload=5.0)
WAITING, STARTED, DONE, FAILED = (
    TaskState.WAITING,
    TaskState.STARTED,
    TaskState.DONE,
    TaskState.FAILED,
)
STEP = 10.0  # time that every step takes [s]
SOON = 0.01  # more than any message needs [s]


class Rig:
    """robot1 at (0, 0) on a network of its own, and what it says."""

    def __init__(self, charge=1.0, fence=None):
        self.network = Network()
        self.listener = Listener(self.network)
        self.talker = NetworkTalker(self.network, "robot1")
        self.battery = Battery(SMALL_ROBOT.battery, charge)
        self.command = TimedCommand(self.network, lambda _: STEP)
        controller = Controller(
            dict.fromkeys(StepKind, self.command),
            self.talker,
            ControllerSettings(attempts=2, retry_delay=1.0),
        )
        self.robot = Robot(
            self.talker,
            "robot1",
            SMALL_ROBOT,
            self.battery,
            StraightWays(),
            controller,
            Pose(0.0, 0.0),
            RobotSettings(),
            MemoryJournal(),
            fence,
        )
        self.command.arrive = self.robot.set_pose
        self.robot.start()
        self.wait()

    def wait(self, duration=SOON):
        self.network.run(duration)

    def order(self, task, assignment=1, **fields):
        heard = self.network.now
        order = Order(task, "robot1", epoch=1, assignment=assignment, heard=heard)
        self.network.send(TASK_ASSIGN, replace(order, **fields))
        self.wait()

    def know(self, task, state, robot="robot1", assignment=1, version=1):
        record = TaskRecord(task, state, robot=robot, assignment=assignment)
        self.network.send(SYNC, TaskList(1, version, (record,)))
        self.wait()

    def set_state(self, word):
        self.network.send("robot1/set_state", word)
        self.wait()

    def bids(self, *tasks):
        offers = tuple((task, 0) for task in tasks)
        self.network.send(TASK_BROADCAST, Broadcast(1, 7, offers))
        self.wait()
        return self.said(TASK_COST)[-1]

    def said(self, topic):
        return [message for name, message in self.network.heard if name == topic]

    def reports(self, task):
        """Return (state, step) of all that was reported on a task."""
        said = self.said(TASK_STATE)
        return [(update.state, update.step) for update in said if update.task_id == task.id]

    @property
    def status(self):
        """The last status that the robot told."""
        return self.said(ROBOT_STATUS)[-1]


def test_a_robot_says_how_it_is_at_the_start_and_then_once_a_second():
    rig = Rig()
    rig.wait(3.0)

    statuses = rig.said(ROBOT_STATUS)
    assert len(statuses) == 4
    assert statuses[0].state is RobotState.IDLE
    assert statuses[0].pose == Pose(0.0, 0.0)
    assert statuses[0].charge == 1.0


def test_it_bids_on_all_that_is_broadcast_in_one_answer():
    rig = Rig()

    answer = rig.bids(GO, CARRY)

    assert (answer.robot_id, answer.epoch, answer.auction) == ("robot1", 1, 7)
    assert [bid.task_id for bid in answer.bids] == ["T1", "T2"]
    assert all(0.0 < bid.cost < MAX_COST for bid in answer.bids)


@pytest.mark.parametrize("word", ["defect", "charging"])
def test_out_of_service_it_bids_max_cost_and_says_why(word):
    rig = Rig(charge=0.5)
    rig.set_state(word)

    (bid,) = rig.bids(GO).bids

    assert (bid.cost, bid.reason) == (MAX_COST, f"{word}, set by an operator")


def test_asked_for_a_task_that_has_not_begun_it_hands_it_back():
    rig = Rig()
    rig.order(GO)
    rig.order(CARRY)
    rig.order(CARRY, take_back=True, hand_back=True, if_unbegun=True)

    assert rig.reports(CARRY) == [(WAITING, 0)]
    assert rig.status.tasks == ("T1",)


def test_asked_for_a_task_that_has_begun_it_keeps_it():
    rig = Rig()
    rig.order(GO)
    rig.order(GO, take_back=True, hand_back=True, if_unbegun=True)

    assert rig.reports(GO) == [(STARTED, 0)]
    assert rig.status.task_id == "T1"


def test_what_is_on_its_own_list_it_bids_on_for_the_list_without_it():
    rig = Rig()
    rig.order(GO)
    alone = rig.bids(CARRY).bids[0].eta
    rig.order(CARRY)

    offered = rig.bids(CARRY).bids[0].eta

    assert offered == pytest.approx(alone)


def test_what_it_has_begun_it_does_not_offer():
    rig = Rig()
    rig.order(GO)

    (bid,) = rig.bids(GO).bids

    assert (bid.cost, bid.reason) == (MAX_COST, "has begun with it")


def test_a_task_is_begun_at_once_and_reported_step_by_step():
    rig = Rig()
    rig.order(CARRY, assignment=3)
    rig.wait(4 * STEP)

    assert rig.reports(CARRY)[:5] == [
        (STARTED, 0),
        (STARTED, 1),
        (STARTED, 2),
        (STARTED, 3),
        (DONE, 4),
    ]
    assert {(said.steps, said.assignment, said.epoch) for said in rig.said(TASK_STATE)} == {
        (4, 3, 1)
    }


def test_every_step_promises_when_the_task_will_be_done():
    rig = Rig()
    rig.order(ROUND)
    rig.wait(STEP)

    # 12 m, and after the first step the 6 m that are left, at 0.6 m/s.
    etas = [said.eta for said in rig.said(TASK_STATE)]
    assert etas == pytest.approx([20.0, 10.0])


def test_the_status_shows_what_it_is_doing_and_all_that_is_on_its_list():
    rig = Rig()
    rig.order(GO)
    rig.order(CARRY)

    assert (rig.status.state, rig.status.task_id) == (RobotState.BUSY, "T1")
    assert rig.status.tasks == ("T1", "T2")


def test_the_next_task_is_begun_when_the_one_before_is_done():
    rig = Rig()
    rig.order(GO)
    rig.order(ROUND)
    before = rig.reports(ROUND)
    rig.wait(STEP)

    assert not before
    assert rig.reports(GO) == [(STARTED, 0), (DONE, 1)]
    assert rig.reports(ROUND) == [(STARTED, 0)]


def test_a_task_that_another_robot_has_begun_goes_on_where_it_was_left():
    rig = Rig()
    rig.order(ROUND, step=1)
    rig.wait(STEP)

    assert [step.goal for step in rig.command.started] == [B]
    assert rig.reports(ROUND) == [(STARTED, 1), (DONE, 2)]


def test_another_robot_s_order_is_none_of_its_business():
    rig = Rig()
    rig.order(GO, robot_id="robot2")

    assert rig.status.tasks == ()


def test_an_order_that_comes_twice_is_carried_out_once():
    rig = Rig()
    rig.order(GO)
    rig.order(GO)
    rig.wait(STEP / 2)
    rig.order(GO)
    meanwhile = rig.status.tasks
    rig.wait(STEP)

    assert meanwhile == ("T1",)
    assert len(rig.command.started) == 1
    assert rig.status.tasks == ()


def test_an_order_that_comes_after_its_end_is_not_carried_out_though_an_old_list_came_between():
    rig = Rig()
    rig.order(GO)
    rig.wait(2 * STEP)
    rig.know(GO, TaskState.DONE, version=2)
    rig.know(GO, TaskState.ASSIGNED, version=1)
    rig.order(GO)

    assert len(rig.command.started) == 1
    assert rig.status.tasks == ()


def test_a_report_is_repeated_until_the_list_shows_that_it_is_known():
    rig = Rig()
    rig.order(GO)
    rig.wait(STEP + 3.0)
    told = len(rig.reports(GO))
    rig.know(GO, DONE)
    rig.wait(3.0)

    assert told == 5  # STARTED, DONE, and DONE once a second
    assert len(rig.reports(GO)) == told


def test_an_order_that_was_answered_already_is_answered_with_the_report():
    rig = Rig()
    rig.order(GO)
    rig.wait(STEP)

    rig.order(GO)

    assert rig.reports(GO) == [(STARTED, 0), (DONE, 1), (DONE, 1)]
    assert len(rig.command.started) == 1


def test_an_order_that_was_slower_than_the_task_list_begins_nothing_anew():
    rig = Rig()
    rig.order(GO)
    rig.wait(STEP)
    rig.know(GO, DONE)

    rig.order(GO)

    assert len(rig.command.started) == 1
    assert rig.status.tasks == ()


def test_a_task_that_was_handed_back_may_be_given_again():
    rig = Rig()
    rig.set_state("defect")
    rig.order(GO, assignment=1)
    rig.set_state("idle")

    rig.order(GO, assignment=2)
    rig.know(GO, STARTED, assignment=2)
    rig.wait(3.0)

    assert rig.reports(GO) == [(WAITING, 0), (STARTED, 0)]


def test_a_task_that_is_taken_back_stops_the_robot_and_the_next_one_begins():
    rig = Rig()
    rig.order(GO)
    rig.order(ROUND)

    rig.order(GO, take_back=True)
    rig.wait(STEP)

    assert rig.reports(GO) == [(STARTED, 0)]
    assert rig.reports(ROUND) == [(STARTED, 0), (STARTED, 1)]


def test_a_task_that_is_taken_back_before_its_turn_disturbs_nothing():
    rig = Rig()
    rig.order(GO)
    rig.order(ROUND)

    rig.order(ROUND, take_back=True)
    rig.wait(STEP)

    assert rig.reports(GO) == [(STARTED, 0), (DONE, 1)]
    assert rig.reports(ROUND) == []


def test_to_take_back_what_it_does_not_have_is_harmless():
    rig = Rig()

    rig.order(GO, take_back=True)

    assert rig.status.state is RobotState.IDLE


def test_to_take_back_an_earlier_assignment_leaves_the_later_one():
    rig = Rig()
    rig.order(GO, assignment=2)

    rig.order(GO, assignment=1, take_back=True)

    assert rig.status.tasks == ("T1",)


@pytest.mark.parametrize(
    ("state", "robot", "assignment"),
    [
        (TaskState.CANCELLED, "robot1", 1),
        (DONE, "robot2", 1),
        (WAITING, "", 1),
        (STARTED, "robot2", 2),
    ],
)
def test_what_the_list_shows_to_be_no_longer_its_own_is_dropped(state, robot, assignment):
    rig = Rig()
    rig.order(GO)

    rig.know(GO, state, robot, assignment)
    rig.wait(STEP)

    assert rig.status.tasks == ()
    assert rig.reports(GO) == [(STARTED, 0)]


@pytest.mark.parametrize(
    ("state", "robot", "assignment"), [(TaskState.ASSIGNED, "robot1", 2), (WAITING, "", 1)]
)
def test_a_list_that_agrees_or_is_older_than_the_order_changes_nothing(state, robot, assignment):
    rig = Rig()
    rig.order(GO, assignment=2)

    rig.know(GO, state, robot, assignment)
    rig.wait(STEP)

    assert rig.reports(GO)[:2] == [(STARTED, 0), (DONE, 1)]


def test_a_step_that_keeps_failing_hands_the_task_back_with_the_reason():
    rig = Rig()
    failure = CommandResult(CommandState.ABORTED, "no way")
    rig.command.results = [failure, failure]
    rig.order(GO)
    rig.wait(2 * STEP + 1.0)

    report = rig.said(TASK_STATE)[-1]
    assert (report.state, report.robot_id, report.step) == (WAITING, "robot1", 0)
    assert report.reason == "robot1: aborted: no way"
    assert rig.status.state is RobotState.IDLE


def test_a_robot_that_is_set_defect_stops_and_hands_all_its_tasks_back():
    rig = Rig()
    rig.order(ROUND)
    rig.order(GO)
    rig.wait(STEP)

    rig.set_state("defect")
    rig.wait(STEP)

    assert (WAITING, 1) in rig.reports(ROUND)
    assert (WAITING, 0) in rig.reports(GO)
    assert len(rig.command.started) == 2
    assert rig.status.state is RobotState.DEFECT
    assert rig.status.tasks == ()
    assert rig.status.reason == "defect, set by an operator"


def test_what_it_is_given_while_out_of_service_it_hands_back():
    rig = Rig()
    rig.set_state("defect")

    rig.order(GO)

    assert rig.reports(GO) == [(WAITING, 0)]
    assert not rig.command.started


def test_a_task_whose_load_is_on_board_has_failed_and_a_person_is_told_where_it_is():
    rig = Rig()
    rig.order(CARRY)
    rig.wait(2 * STEP)

    rig.set_state("defect")

    report = rig.said(TASK_STATE)[-1]
    assert (report.state, report.step) == (FAILED, 2)
    assert "its load of 5 kg is on board at (6.00, 0.00): take it off" in report.reason
    assert rig.status.reason == (
        "the load of T2 (5 kg) is on board: take it off, then set the robot idle"
    )
    assert rig.status.payload == 5.0


def test_before_the_pick_nothing_is_on_board_and_the_task_is_handed_back():
    rig = Rig()
    rig.order(CARRY)
    rig.wait(STEP)

    rig.set_state("defect")

    assert rig.reports(CARRY)[-1] == (WAITING, 1)
    assert rig.status.payload == 0.0


def test_a_robot_that_fails_with_a_load_on_board_leaves_service_and_hands_back_the_rest():
    rig = Rig()
    rig.order(CARRY)
    rig.order(GO)
    rig.wait(2 * STEP)
    lost = CommandResult(CommandState.LOST, "no answer")
    rig.command.results = [lost, lost]
    rig.wait(4 * STEP)

    assert (FAILED, 3) in rig.reports(CARRY)
    assert (WAITING, 0) in rig.reports(GO)
    assert rig.status.state is RobotState.DEFECT


def test_a_cancelled_task_whose_load_is_on_board_takes_the_robot_out_of_service():
    rig = Rig()
    rig.order(CARRY)
    rig.wait(2 * STEP)

    rig.order(CARRY, take_back=True)

    assert rig.status.state is RobotState.DEFECT
    assert rig.status.payload == 5.0
    assert "take it off" in rig.status.reason


def test_set_idle_it_is_in_service_again_and_empty():
    rig = Rig()
    rig.order(CARRY)
    rig.wait(2 * STEP)
    rig.set_state("defect")

    rig.set_state("idle")

    assert rig.status.state is RobotState.IDLE
    assert (rig.status.payload, rig.status.reason) == (0.0, "")
    assert rig.bids(GO).bids[0].is_able


def test_to_set_a_robot_idle_that_is_at_work_disturbs_nothing():
    rig = Rig()
    rig.order(GO)
    rig.wait(STEP / 2)

    rig.set_state("idle")
    rig.wait(STEP / 2)

    assert rig.reports(GO) == [(STARTED, 0), (DONE, 1)]


def test_an_unknown_state_is_refused_with_those_there_are():
    rig = Rig()

    rig.set_state("sleepy")

    assert rig.talker.warnings == [
        "a message on set_state is refused: 'sleepy' is unknown; allowed: idle, defect, charging"
    ]
    assert rig.status.state is RobotState.IDLE


def test_charging_takes_its_time_and_ends_in_service():
    rig = Rig(charge=0.5)
    rig.set_state("charging")
    rig.wait(1700.0)
    before = rig.status
    rig.wait(200.0)

    # Half of 3600 s, and a little more because 20 W are drawn meanwhile.
    assert before.state is RobotState.CHARGING
    assert rig.status.state is RobotState.IDLE
    assert rig.status.charge > 0.99


@pytest.mark.parametrize("words", [["charging"], ["defect", "charging"]])
def test_a_charged_robot_stays_out_of_service_while_a_load_was_left_on_board(words):
    rig = Rig(charge=0.9)
    rig.order(CARRY)
    rig.wait(2 * STEP)
    for word in words:
        rig.set_state(word)

    rig.wait(600.0)

    assert rig.status.state is RobotState.DEFECT
    assert rig.status.payload == 5.0
    assert "take it off" in rig.status.reason


def test_driving_with_a_load_takes_more_than_without():
    def taken(rig):
        before = rig.battery.charge_left
        rig.robot.add_travel(1000.0)
        return before - rig.battery.charge_left

    empty, loaded = Rig(), Rig()
    loaded.order(ROUND)

    # 55 kg over 50 kg.
    assert taken(loaded) == pytest.approx(1.1 * taken(empty), rel=1e-3)


def test_the_arm_takes_its_power_for_its_time():
    rig = Rig()
    rig.order(replace(CARRY, payload=0.0))
    rig.wait(4 * STEP)

    # 100 W for 5 s and 4 s, and 20 W all the time, at about 28 V.
    energy = 100.0 * 9.0 + 20.0 * 40.0
    used = (1.0 - rig.battery.level) * SMALL_ROBOT.battery.capacity
    assert used == pytest.approx(energy / (3600.0 * 28.0), rel=2e-3)


def test_standing_still_takes_the_idle_power():
    rig = Rig()
    rig.wait(100.0)

    used = (1.0 - rig.status.charge) * SMALL_ROBOT.battery.capacity
    assert used == pytest.approx(20.0 * 100.0 / (3600.0 * 28.0), rel=2e-3)


class Beside:
    """The member beside a robot, as the test tells it to be; see `blackboard.fence.Fence`."""

    hive = ""
    active = carriers = None

    def __init__(self):
        self.asked = 0

    def obeys(self, _hive, _epoch):
        return True

    def follow(self, hear):
        self.tell = hear

    def show(self):
        self.asked += 1


def test_a_robot_beside_a_member_believes_that_one_and_not_what_is_told_to_everyone():
    member = Beside()
    rig = Rig(fence=member)
    rig.order(GO)
    rig.know(GO, TaskState.CANCELLED)
    meanwhile = rig.status.tasks

    cancelled = TaskRecord(GO, TaskState.CANCELLED, robot="robot1", assignment=1)
    member.tell(TaskList(1, 2, (cancelled,)))
    rig.wait()

    assert meanwhile == ("T1",)
    assert rig.status.tasks == ()


def test_a_robot_asks_its_member_for_the_list_with_every_status():
    member = Beside()
    rig = Rig(fence=member)

    rig.wait(3.0)

    assert member.asked == 3


# Tasks that the hive has forgotten.


def test_a_robot_drops_a_task_that_the_hive_has_forgotten():
    rig = Rig()
    rig.order(GO)
    rig.order(GO, assignment=2**32 - 1, take_back=True, forgotten=True)

    assert rig.status.tasks == ()
    assert rig.command.running is None


def test_a_robot_reports_no_more_on_a_task_that_the_hive_has_forgotten():
    rig = Rig()
    rig.order(GO)
    rig.wait(STEP + 1.5)
    rig.order(GO, take_back=True, forgotten=True)
    said = len(rig.reports(GO))
    rig.wait(5.0)

    assert rig.reports(GO)[said - 1] == (DONE, 1)
    assert len(rig.reports(GO)) == said


def test_a_report_is_kept_that_is_on_a_later_task_than_the_forgotten_one():
    rig = Rig()
    rig.order(GO, assignment=3)
    rig.wait(STEP + 1.5)
    rig.order(GO, assignment=2, take_back=True, forgotten=True)
    said = len(rig.reports(GO))
    rig.wait(5.0)

    assert len(rig.reports(GO)) > said


def test_that_a_task_is_forgotten_counts_only_while_it_is_news():
    rig = Rig()
    rig.order(GO)
    rig.order(GO, assignment=9, take_back=True, forgotten=True, heard=-10.0)

    assert rig.status.tasks == ("T1",)


def test_what_was_done_is_done_again_as_another_task_once_it_is_forgotten():
    rig = Rig()
    rig.order(GO)
    rig.wait(STEP + 1.5)
    rig.order(GO, take_back=True, forgotten=True)
    rig.order(GO, assignment=2)

    assert rig.status.tasks == ("T1",)
