# SPDX-License-Identifier: BSD-3-Clause
"""Robots that go to chargers by themselves, and never two of them to the same one."""

import random
from dataclasses import replace
from itertools import combinations

import pytest
from attrs import evolve

from blackboard.domain.characteristics import RobotState
from blackboard.domain.settings import BlackboardSettings, ChargingSettings
from blackboard.domain.talker import ROBOT_STATUS
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.errors import SettingsError
from blackboard.robot.charger_claims import Claim, Claims
from blackboard.robot.charging import ChargingPlan
from blackboard.robot.executor import CommandResult, CommandState
from hive_common.last_heard import FORGOTTEN_AFTER
from hive_common.pose import Pose
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
SILENCE = 5.0
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

    hive.network.run(12.0)

    # The lease of robot1 has ended: it has halted, and only then has robot2 gone.
    assert on_the_way == {frozenset(), frozenset({"robot1"}), frozenset({"robot2"})}


def test_a_robot_that_starts_again_at_a_charger_goes_on_charging():
    hive = Hive()
    hive.add_robot("robot1", EAST, charge=0.25, charging=ONE)
    hive.network.run(5.0)

    assert goals(hive) == []
    assert "charges at charger 1" in status(hive).reason


class Lossy:
    """Some robots that claim one charger at random times, on links that lose and delay."""

    def __init__(self, seed, loss):
        self.dice = random.Random(seed)
        self.loss = loss
        self.now = 100.0
        names = ("robot1", "robot2", "robot3")
        self.claims = {name: Claims(name, {"charger 1": EAST}, 100.0) for name in names}
        self.under_way = []
        self.last = {}

    def tick(self):
        self.now += 0.25
        for sender, claims in self.claims.items():
            said = claims.say(HERE)
            for name in self.claims:
                if name != sender and self.dice.random() >= self.loss:
                    when = self.now + self.dice.uniform(0.0, 1.0)
                    # A connection loses and delays, but keeps the order.
                    when = self.last[sender, name] = max(when, self.last.get((sender, name), 0.0))
                    self.under_way.append((when, name, said))
        late = [each for each in self.under_way if each[0] > self.now]
        due = [each for each in self.under_way if each[0] <= self.now]
        self.under_way = late
        for _, name, said in sorted(due, key=lambda each: each[0]):
            self.claims[name].hear(said, self.now)
        for claims in self.claims.values():
            self.act(claims)

    def act(self, claims):
        if claims.holds and self.dice.random() < 0.1:
            claims.release()
        elif not claims.charger and claims.free(self.now, SILENCE) and self.dice.random() < 0.3:
            claims.claim("charger 1", self.now)
        claims.settle(self.now, SILENCE)


@pytest.mark.parametrize("seed", range(8))
def test_two_robots_never_hold_one_charger_whatever_is_lost_or_late(seed):
    robots = Lossy(seed, loss=0.4)
    held = 0
    for _ in range(1000):
        robots.tick()
        holders = [claims for claims in robots.claims.values() if claims.holds]
        held += bool(holders)

        assert len(holders) <= 1

    assert held > 50


def test_a_robot_that_fell_silent_on_its_way_keeps_no_charger_but_one_at_it_does():
    claims = Claims("robot1", {"charger 1": EAST}, 0.0)
    claims.hear(Claim("robot2", "charger 1", 1.0, HERE), 10.0)

    assert claims.free(10.1, SILENCE) == ()
    assert claims.free(10.0 + SILENCE, SILENCE) == ("charger 1",)

    claims.hear(Claim("robot2", "charger 1", 1.0, EAST), 20.0)

    assert claims.free(60.0, SILENCE) == ()


@pytest.mark.parametrize(("lower", "upper"), list(combinations(LEVELS, 2)))
def test_thresholds_out_of_order_are_refused(lower, upper):
    defaults = ChargingSettings()
    swapped = {lower: getattr(defaults, upper), upper: getattr(defaults, lower)}

    with pytest.raises(SettingsError, match="each above the one before"):
        evolve(defaults, **swapped)


def test_a_robot_that_has_left_is_not_conceded_to_any_more_but_one_at_a_charger_is_in_the_way():
    claims = Claims("robot1", {"charger 1": EAST}, 0.0)
    claims.hear(Claim("there", "charger 1", 1.0, EAST), 0.0)
    claims.hear(Claim("left", "", 2.0, HERE), 1.0)
    claims.hear(Claim("robot2", "", 3.0, HERE), FORGOTTEN_AFTER + 1.0)

    assert claims.say(HERE).conceded == (("there", 1.0), ("robot2", 3.0))
    assert claims.free(FORGOTTEN_AFTER + 1.0, SILENCE) == ()


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
