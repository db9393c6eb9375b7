# SPDX-License-Identifier: BSD-3-Clause
"""Robots that go to chargers by themselves, and never two of them to the same one."""

from dataclasses import replace
from itertools import combinations

import pytest
from attrs import evolve

from blackboard.domain.characteristics import RobotState
from blackboard.domain.settings import BlackboardSettings, ChargingSettings
from blackboard.domain.talker import ROBOT_STATUS
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.errors import SettingsError
from blackboard.robot.charging import ChargingPlan
from blackboard.robot.executor import CommandResult, CommandState
from hive_common.pose import Pose
from hive_lab.virtual.harness import RobotHarness
from hive_lab.virtual.hive import SMALL_ROBOT, Hive

A, B = Pose(10.0, 0.0), Pose(20.0, 0.0)
EAST, WEST = Pose(5.0, 5.0), Pose(-5.0, 5.0)
ONE = ChargingPlan({"charger 1": EAST})
TWO = ChargingPlan({"charger 1": EAST, "charger 2": WEST})
GO = Task("T1", TaskType.GA, (A,))
CARRY = Task("T2", TaskType.GPAB, (A, B), payload=5.0)
FAR = Task("T3", TaskType.GA, (Pose(200.0, 0.0),))
HERE = Pose(0.0, 0.0)
HOUR = 3600.0
LEVELS = ("critical", "low", "enough", "full")


def status(hive, robot="robot1"):
    said = [m for topic, m in hive.network.heard if topic == ROBOT_STATUS]
    return [m for m in said if m.robot_id == robot][-1]


def goals(hive, robot="robot1"):
    return [step.goal for step in hive.commands[robot].started]


def alone(charge, plan=ONE):
    hive = Hive()
    hive.add_robot("robot1", HERE, charge=charge, charging=plan)
    return hive


def test_an_idle_robot_with_a_low_battery_goes_to_a_charger():
    hive = alone(0.25)
    hive.network.run(20.0)

    assert goals(hive) == [EAST]
    assert status(hive).state is RobotState.CHARGING
    assert "charges at charger 1" in status(hive).reason


def test_a_robot_with_enough_in_its_battery_stays_where_it_is():
    hive = alone(0.35)
    hive.network.run(60.0)

    assert goals(hive) == []


def test_a_robot_takes_the_nearest_charger():
    hive = Hive()
    hive.add_robot("robot1", Pose(-2.0, 0.0), charge=0.25, charging=TWO)
    hive.network.run(20.0)

    assert goals(hive) == [WEST]


def test_a_robot_that_finds_no_path_to_one_charger_tries_another():
    hive = alone(0.25, TWO)
    lost = CommandResult(CommandState.ABORTED, "no way")
    hive.commands["robot1"].results = [lost] * 3
    hive.network.run(60.0)

    assert set(goals(hive)) == {EAST, WEST}
    assert status(hive).state is RobotState.CHARGING


def test_a_charging_robot_takes_tasks_again_once_it_has_enough():
    hive = alone(0.25)
    hive.network.run(20.0)
    hive.post(GO)
    hive.network.run(60.0)

    assert hive.states("T1") == [TaskState.WAITING]

    hive.network.run(0.4 * HOUR)

    assert hive.states("T1")[-1] is TaskState.DONE


def test_a_full_robot_goes_back_to_where_it_started():
    hive = alone(0.25)
    hive.network.run(HOUR)

    assert goals(hive) == [EAST, HERE]
    assert status(hive).state is RobotState.IDLE


def test_a_critical_robot_without_a_load_hands_back_its_task_and_charges_at_once():
    hive = alone(0.16)
    hive.post(Task("T1", TaskType.GAB, (A, B)))
    hive.network.run(1.0)
    hive.robots["robot1"].add_travel(4_000.0)
    hive.network.run(30.0)

    assert goals(hive) == [A, EAST]
    assert hive.record("T1").state is TaskState.WAITING


def test_a_critical_robot_puts_down_its_load_first():
    hive = alone(0.16)
    hive.post(CARRY)
    hive.network.run(25.0)
    hive.robots["robot1"].add_travel(4_000.0)
    hive.network.run(60.0)

    assert hive.states("T2")[-1] is TaskState.DONE
    assert goals(hive)[-1] == EAST
    assert status(hive).state is RobotState.CHARGING


def test_a_critical_robot_is_given_nothing_new():
    hive = alone(0.16)
    hive.post(CARRY)
    hive.network.run(25.0)
    hive.robots["robot1"].add_travel(4_000.0)
    hive.post(GO)
    hive.network.run(10.0)

    assert "charges next" in hive.record("T1").reason


def test_a_task_after_which_no_charger_could_be_reached_is_not_given():
    thin = replace(SMALL_ROBOT, battery=replace(SMALL_ROBOT.battery, capacity=0.5))
    hive = Hive()
    hive.add_robot("robot1", HERE, thin, charge=0.4, charging=ONE)
    hive.post(FAR)
    hive.network.run(1.0)

    assert "on the way to a charger" in hive.record("T3").reason


def test_a_robot_that_strands_says_where_and_its_task_moves_on():
    hive = alone(1.0, None)
    hive.post(GO)
    hive.network.run(1.0)
    hive.robots["robot1"].set_pose(Pose(3.0, 4.0))
    hive.robots["robot1"].add_travel(1_000_000.0)
    hive.network.run(2.0)

    assert status(hive).state is RobotState.DEFECT
    assert "stranded at" in status(hive).reason
    assert "3" in status(hive).reason
    assert hive.record("T1").state is TaskState.WAITING

    hive.add_robot("robot2", HERE)
    hive.network.run(40.0)

    assert hive.record("T1").state is TaskState.DONE
    assert hive.record("T1").robot == "robot2"


def test_a_person_can_call_a_robot_off_its_way_to_a_charger():
    hive = alone(0.25)
    hive.network.run(8.0)
    hive.set_state("robot1", "defect")
    hive.network.run(1.0)

    assert hive.commands["robot1"].running is None
    assert status(hive).state is RobotState.DEFECT


def test_of_two_robots_one_waits_until_the_other_has_left_the_charger():
    hive = Hive()
    for name, charge in (("robot1", 0.2), ("robot2", 0.25)):
        hive.add_robot(name, HERE, charge=charge, charging=ONE)
    hive.network.run(60.0)

    assert [name for name in hive.robots if goals(hive, name)] == ["robot1"]

    hive.network.run(1.5 * HOUR)

    assert goals(hive, "robot2")[0] == EAST


def test_a_robot_that_works_on_in_silence_keeps_its_charger_as_long_as_its_lease_may_last():
    hive = Hive(BlackboardSettings(robot_lease=20.0, reassign=25.0))
    for name in ("robot1", "robot2"):
        hive.add_robot(name, HERE, charge=0.25, charging=ONE)
        hive.commands[name].duration = lambda _: 60.0
    on_the_way = set()

    def look():
        driving = {name for name in hive.robots if hive.commands[name].running}
        on_the_way.add(frozenset(driving))

    hive.network.watch(look)
    hive.network.run_until(lambda: hive.commands["robot1"].running, limit=60.0)
    hive.talkers["robot1"].connected = False
    hive.network.run(18.0)

    assert hive.commands["robot1"].running

    hive.network.run(15.0)

    # The lease of robot1 has ended: it has halted, and only then has robot2 gone.
    assert on_the_way == {frozenset(), frozenset({"robot1"}), frozenset({"robot2"})}


def test_a_robot_that_starts_again_at_a_charger_goes_on_charging():
    hive = Hive()
    hive.add_robot("robot1", EAST, charge=0.25, charging=ONE)
    hive.network.run(5.0)

    assert goals(hive) == []
    assert "charges at charger 1" in status(hive).reason


def test_a_robot_that_fell_silent_on_its_way_keeps_no_charger_but_one_at_it_does():
    hive = Hive()
    for name in ("robot1", "robot2"):
        hive.add_robot(name, HERE, charge=0.25, charging=ONE)
    hive.commands["robot1"].duration = lambda _: 60.0
    hive.network.run_until(lambda: hive.commands["robot1"].running, limit=10.0)
    hive.talkers["robot1"].connected = False
    hive.network.run(20.0)

    assert "charges at charger 1" in status(hive, "robot2").reason

    hive.talkers["robot2"].connected = False
    hive.add_robot("robot3", HERE, charge=0.25, charging=ONE)
    hive.network.run(60.0)

    assert goals(hive, "robot3") == []


def test_a_robot_that_strands_on_its_way_or_before_leaves_the_charger_to_others():
    hive = Hive()
    for name in ("robot1", "robot2"):
        hive.add_robot(name, HERE, charge=0.25, charging=ONE)
    hive.network.run_until(lambda: hive.commands["robot1"].running, limit=10.0)
    hive.robots["robot1"].add_travel(1_000_000.0)
    hive.network.run(15.0)

    assert "stranded" in status(hive).reason
    assert status(hive).charger == ""
    assert "charges at charger 1" in status(hive, "robot2").reason


@pytest.mark.parametrize(("lower", "upper"), list(combinations(LEVELS, 2)))
def test_thresholds_out_of_order_are_refused(lower, upper):
    defaults = ChargingSettings()
    swapped = {lower: getattr(defaults, upper), upper: getattr(defaults, lower)}

    with pytest.raises(SettingsError, match="each above the one before"):
        evolve(defaults, **swapped)


def test_an_operator_sends_a_robot_to_charge_that_needs_it_not():
    hive = alone(0.7)
    hive.robots["robot1"].set_state("charge")
    hive.network.run(20.0)

    assert goals(hive) == [EAST]
    assert status(hive).state is RobotState.CHARGING

    hive.network.run(HOUR)
    assert status(hive).state is RobotState.IDLE
    said = [m.charge for topic, m in hive.network.heard if topic == ROBOT_STATUS]
    assert max(said) >= ChargingSettings().full


def test_a_robot_that_is_sent_to_charge_hands_its_task_to_another():
    hive = alone(0.7)
    hive.post(GO)
    hive.network.run(2.0)
    hive.add_robot("robot2", Pose(0.0, 1.0))
    hive.robots["robot1"].set_state("charge")
    hive.network.run(30.0)

    assert goals(hive)[-1] == EAST
    assert goals(hive, "robot2") == [A]


def test_a_robot_that_is_sent_to_charge_puts_down_its_load_first():
    hive = alone(0.9)
    hive.post(CARRY)
    hive.network.run(25.0)
    assert status(hive).payload > 0
    hive.robots["robot1"].set_state("charge")
    hive.network.run(60.0)

    assert goals(hive) == [A, A, B, B, EAST]


def test_a_robot_without_chargers_or_out_of_service_says_why_it_does_not_go_to_charge():
    hive = alone(0.5, ChargingPlan())
    hive.robots["robot1"].set_state("charge")
    assert "the fleet has no chargers" in hive.robots["robot1"].charging.send()

    hive = alone(0.5)
    hive.robots["robot1"].set_state("defect")
    hive.robots["robot1"].set_state("charge")
    hive.network.run(20.0)
    assert goals(hive) == []
    assert status(hive).state is RobotState.DEFECT


@pytest.mark.parametrize("charge", [1.0, 0.97])
def test_a_full_robot_that_is_sent_to_charge_goes_there_and_takes_tasks_again(charge):
    hive = alone(charge)
    hive.set_state("robot1", "charge")
    hive.network.run(60.0)
    hive.post(GO)
    hive.network.run(60.0)

    assert goals(hive) == [EAST, HERE, A]
    assert hive.states("T1")[-1] is TaskState.DONE


def test_a_robot_that_charges_where_it_stands_is_sent_to_a_charger():
    hive = alone(0.7)
    hive.set_state("robot1", "charging")
    hive.network.run(2.0)
    hive.set_state("robot1", "charge")
    hive.network.run(20.0)

    assert goals(hive) == [EAST]
    assert "charges at charger 1" in status(hive).reason


def test_a_robot_that_is_sent_to_charge_is_given_nothing_new_while_it_puts_down_its_load():
    hive = alone(0.9)
    hive.post(CARRY)
    hive.network.run(25.0)
    hive.set_state("robot1", "charge")
    hive.post(GO)
    hive.network.run(2.0)

    assert status(hive).state is RobotState.BUSY
    assert "an operator has sent it to charge" in hive.record("T1").reason


def test_a_robot_that_is_sent_to_charge_on_its_way_home_turns_round_at_once():
    hive = alone(1.0)
    hive.set_state("robot1", "charge")
    hive.network.run_until(lambda: goals(hive)[-1:] == [HERE], limit=60.0)
    hive.robots["robot1"].set_pose(Pose(4.0, 4.0))
    hive.set_state("robot1", "charge")
    hive.network.run(2.0)

    assert goals(hive) == [EAST, HERE, EAST]


def test_a_robot_at_a_charger_that_has_charged_enough_is_sent_to_charge_until_it_is_full():
    hive = alone(0.25)
    robot = hive.robots["robot1"]
    hive.network.run_until(lambda: robot.status.charge > 0.62, limit=HOUR)
    before = robot.status.state
    hive.set_state("robot1", "charge")
    hive.network.run(2.0)
    after = robot.status
    hive.network.run_until(lambda: robot.state is RobotState.IDLE, limit=HOUR)

    assert (before, after.state) == (RobotState.IDLE, RobotState.CHARGING)
    assert "charges at charger 1" in after.reason
    assert robot.status.charge >= ChargingSettings().full


def test_an_operator_calls_a_robot_back_that_was_sent_to_charge():
    hive = alone(0.7)
    hive.set_state("robot1", "charge")
    hive.network.run(8.0)
    hive.set_state("robot1", "idle")
    hive.network.run(60.0)

    assert goals(hive) == [EAST]
    assert status(hive).state is RobotState.IDLE
    assert status(hive).pose == HERE


def test_a_robot_that_stops_on_its_way_goes_on_by_a_new_grant_only():
    plan = ChargingPlan({"east": EAST})
    harness = RobotHarness(charge=0.25, charging=plan)
    harness.give_chargers(2, east="robot1")
    harness.wait(0.5)
    first = harness.status.charger_since
    harness.set_state("idle")  # It stops on its way, gives the charger up, and needs it anew.
    harness.wait(5.0)
    asked = harness.status
    before = [step.goal for step in harness.command.started]
    harness.give_chargers(3, east="robot1")
    harness.wait(0.1)

    assert asked.charger == "east"
    assert asked.charger_since > first
    assert before == [EAST]  # Its list still shows the first grant.
    assert [step.goal for step in harness.command.started] == [EAST, EAST]


def test_a_robot_without_its_lease_asks_for_no_charger_and_then_anew():
    harness = RobotHarness(charge=0.25, charging=ChargingPlan({"east": EAST}))
    harness.wait(0.5)
    first = harness.status
    harness.talker.connected = False
    harness.wait(20.0)
    without = harness.robot.status.charger
    harness.talker.connected = True
    harness.wait(2.0)
    harness.give_chargers(2, since=first.charger_since, east="robot1")
    harness.wait(2.0)

    assert (first.charger, without, harness.status.charger) == ("east", "", "east")
    assert harness.status.charger_since > first.charger_since
    assert harness.command.started == []


def test_a_robot_whose_date_was_set_back_says_what_is_newer_than_its_grant():
    harness = RobotHarness(charge=0.9, charging=ChargingPlan({"east": EAST}))
    later = harness.status.charger_since + 100.0
    harness.give_chargers(2, since=later, east="robot1")

    assert harness.status.charger == ""
    assert harness.status.charger_since > later


@pytest.mark.parametrize(
    ("stops_at", "keeps"), [(Pose(4.0, 5.0), True), (Pose(2.0, 3.0), False)], ids=["there", "away"]
)
def test_a_robot_that_stops_on_its_way_keeps_the_charger_until_it_knows_where_it_stands(
    stops_at, keeps
):
    harness = RobotHarness(charge=0.25, charging=ChargingPlan({"east": EAST}))
    harness.give_chargers(2, east="robot1")
    harness.wait(0.5)
    harness.set_state("idle")
    going = harness.status
    harness.robot.set_pose(stops_at)  # It braked, and its position came late.
    harness.wait(2.0)
    after = [s for s in harness.said(ROBOT_STATUS) if s.charger_since > going.charger_since]

    assert going.charger == "east"
    assert (after[0].charger, after[0].at_charger) == (("east", True) if keeps else ("", False))


def test_a_robot_that_stands_at_a_charger_of_another_asks_for_a_free_one():
    harness = RobotHarness(charge=0.25, charging=ChargingPlan({"here": HERE, "west": WEST}))
    before = harness.status
    harness.give_chargers(2, here="robot2")
    harness.wait(1.0)

    assert (before.charger, before.at_charger) == ("here", True)
    assert (harness.status.charger, harness.status.at_charger) == ("west", False)


def test_a_robot_that_waits_for_a_charger_says_who_has_it():
    harness = RobotHarness(charge=0.1, charging=ChargingPlan({"dock": EAST}))
    harness.give_chargers(2, dock="robot2")
    harness.wait(1.0)

    assert harness.status.reason.endswith("waits for a charger: robot2 has dock")


def test_the_charger_of_a_robot_that_died_there_is_free_when_the_hive_has_forgotten_the_robot():
    hive = Hive()
    hive.add_robot("robot1", HERE, charge=0.25, charging=ONE)
    hive.network.run(20.0)
    hive.kill("robot1")
    hive.add_robot("robot2", HERE, charge=0.25, charging=ONE)
    hive.network.run(600.0)
    at_first = goals(hive, "robot2")
    hive.network.run(HOUR)

    assert (at_first, goals(hive, "robot2")) == ([], [EAST])


def test_a_robot_that_died_at_a_charger_and_starts_elsewhere_gives_the_charger_up():
    hive = Hive()
    hive.add_robot("robot1", HERE, charge=0.25, charging=ONE)
    hive.network.run(20.0)
    hive.kill("robot1")
    hive.add_robot("robot2", HERE, charge=0.25, charging=ONE)
    hive.network.run(20.0)
    at_first = goals(hive, "robot2")
    hive.add_robot("robot1", HERE, charge=0.9, charging=ONE)
    hive.post(GO)  # These robots are beside no member, and see the list when it changes.
    hive.network.run(20.0)

    assert (at_first, goals(hive, "robot2")) == ([], [EAST])
