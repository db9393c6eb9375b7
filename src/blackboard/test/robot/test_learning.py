# SPDX-License-Identifier: BSD-3-Clause
"""A robot learns what its steps and tasks take, and still knows it after a restart."""

import math
import re
from dataclasses import replace

import pytest

from blackboard.consensus.journal import MemoryJournal
from blackboard.costing.cost import friction_force
from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.costing.experience import MEAN_SPEED_SHARE
from blackboard.costing.saved_experience import saved_from
from blackboard.domain.battery import SECONDS_PER_HOUR
from blackboard.domain.task import StepKind, Task, TaskType, split_task
from blackboard.errors import JournalError
from blackboard.robot.learning import Learning
from hive_common.pose import Pose
from hive_lab.fleets.true_battery import TrueBattery
from hive_lab.virtual.hive import SMALL_ROBOT, Hive
from hive_lab.virtual.network import Network, NetworkTalker

HERE, A, B = Pose(0.0, 0.0), Pose(6.0, 0.0), Pose(12.0, 0.0)
CARRY = Task("T1", TaskType.GPAB, (A, B), payload=5.0)

BODY = replace(SMALL_ROBOT, idle_power=2.0, arm_power=10.0)
ENERGY = 2 * 9.0 * 2.0 + 2 * 9.0 * 12.0 + 0.02 * 50.0 * 9.80665 * 12.0
"""What the bench's robot draws for it [J]: standing, the arm, and friction."""


class Bench:
    """One robot's learning, which is told what the robot does."""

    def __init__(self, journal=None, *, measures=True):
        self.network = Network()
        self.talker = NetworkTalker(self.network, "robot1")
        self.battery = TrueBattery(BODY)
        self.gauge = self.battery.measured if measures else self.battery
        self.journal = journal or MemoryJournal()
        self.learning = Learning(
            self.talker, "robot1", BODY, self.gauge, EuclideanLengths(), self.journal
        )
        self.told = []
        self.learning.tell_to(self.told.append)

    def do(self, task=CARRY, seconds=9.0, friction=1.0):
        """Do a task from here, each of whose steps takes the same time.

        `friction` is the share of what friction draws by the formula.
        """
        here = HERE
        self.learning.begin_task(task, 0, here)
        for step in split_task(task):
            done = self.learning.time_step(step, here, 0.0)
            self.network.run(seconds)
            drives = step.kind is StepKind.MOVE
            watts = BODY.idle_power + (0.0 if drives else BODY.arm_power)
            force = friction_force(BODY.friction_coefficient, BODY.mass)
            way = friction * force * here.distance_to(step.goal)
            self.battery.update_level(watts * seconds + way)
            here = step.goal
            done()
        self.learning.end_task(task.id)

    @property
    def outcome(self):
        """The last task, as predicted and as it was."""
        return self.told[-1].tasks[-1]


def test_a_task_is_compared_with_what_was_predicted_when_it_began():
    bench = Bench()
    bench.do()

    assert bench.outcome.time == pytest.approx(36.0)
    assert bench.outcome.energy == pytest.approx(ENERGY, rel=1e-3)
    formula = 12.0 / MEAN_SPEED_SHARE + BODY.pick_duration + BODY.place_duration
    assert bench.outcome.formula_time == bench.outcome.predicted_time == pytest.approx(formula)
    assert bench.outcome.most_time > bench.outcome.predicted_time


def test_after_some_tasks_it_predicts_their_time_and_energy():
    bench = Bench()
    for _ in range(25):
        bench.do()

    assert bench.outcome.predicted_time == pytest.approx(36.0, rel=0.02)
    assert bench.outcome.predicted_energy == pytest.approx(ENERGY, rel=0.02)
    assert bench.outcome.formula_time == pytest.approx(29.0)


def test_what_it_has_learned_survives_a_restart():
    bench = Bench()
    for _ in range(5):
        bench.do()

    again = Bench(bench.journal)

    assert again.learning.experience.learned == bench.learning.experience.learned
    assert again.told == [bench.told[-1]]


def test_odd_content_in_the_journal_is_told_and_the_robot_learns_anew():
    bench = Bench(MemoryJournal(experience={"learned": [1.0]}))

    assert bench.learning.experience.is_formula
    (warning,) = bench.talker.warnings
    assert warning.startswith("robot1 learns anew: its journal cannot be used: learned")


def test_a_full_disk_keeps_no_robot_from_learning():
    class Full(MemoryJournal):
        def save_experience(self, _):
            raise JournalError("no space left on device")

    bench = Bench(Full())
    bench.do()

    assert bench.talker.warnings == [
        "robot1 will not remember what it has learned: no space left on device"
    ]
    assert bench.told[-1].tasks


def test_what_it_is_told_to_forget_is_gone_after_a_restart_too():
    bench = Bench()
    bench.do()
    bench.learning.forget()

    assert bench.learning.experience.is_formula
    assert Bench(bench.journal).learning.experience.is_formula
    assert bench.told[-1].learned == tuple(bench.learning.experience.learned)


def test_a_robot_with_experience_of_its_own_takes_no_others():
    others = Bench()
    for _ in range(9):
        others.do(seconds=20.0)
    fresh, old = Bench(), Bench()
    old.do()
    before = old.learning.experience.learned

    for each in (fresh, old):
        each.learning.begin_with([others.told[-1]])

    expected = others.learning.experience.duration(HERE, A, 6.0)
    assert fresh.learning.experience.duration(HERE, A, 6.0) == pytest.approx(expected)
    assert old.learning.experience.learned == before


def test_a_change_is_told_to_who_runs_the_robot():
    bench = Bench()
    for _ in range(20):
        bench.do()
    for _ in range(4):
        bench.do(friction=2.5)

    (warning,) = bench.talker.warnings
    assert re.match(r"robot1: after 4\d drives: steps draw \d+% more energy", warning)
    assert "; check its wheels" in warning


def test_a_task_that_another_ends_says_nothing():
    bench = Bench()
    bench.learning.begin_task(CARRY, 0, HERE)
    bench.network.run(30.0)
    bench.battery.update_level(500.0)
    bench.learning.end_task("T2")
    bench.learning.end_task("T1")

    assert bench.told[-1].tasks == ()


def test_a_measured_battery_tells_the_energy_of_drives_and_arm():
    bench = Bench()
    before = bench.battery.charge_left
    bench.do()

    lost = (before - bench.battery.charge_left) * SECONDS_PER_HOUR * bench.battery.get_volts()
    assert bench.outcome.energy == pytest.approx(lost)


def test_what_a_robot_reckons_by_the_formula_teaches_it_nothing_about_energy():
    bench = Bench(measures=False)
    for _ in range(20):
        bench.do(friction=2.5)

    learned = bench.learning.experience.learned
    assert (learned.friction, learned.power) == (1.0, 1.0)
    assert bench.talker.warnings == []


def test_a_robot_of_a_hive_predicts_better_once_it_has_driven():
    """Its steps take 10 s each, however far they lead."""
    hive = Hive()
    hive.add_robot("robot1", HERE)
    errors = []
    for number in range(12):
        goal = Pose(5.0 * (-1) ** number, 1.0)
        hive.post(Task(f"T{number}", TaskType.GA, (goal,)))
        hive.network.run(20.0)
        started = next(u for u in hive.updates(f"T{number}") if u.eta)
        errors.append(abs(started.eta - 10.0))

    assert errors[1] > 3.0
    assert errors[-1] < 1.0


def test_a_drive_that_was_stopped_half_way_is_not_learned_from():
    hive = Hive()
    hive.add_robot("robot1", HERE)
    hive.commands["robot1"].duration = lambda _: 1000.0
    hive.post(Task("T1", TaskType.GA, (Pose(5.0, 0.0),)))
    hive.network.run(5.0)
    hive.cancel("T1")
    hive.network.run(5.0)
    hive.post(Task("T2", TaskType.GA, (Pose(5.0, 0.0),)))
    hive.network.run(5.0)

    started = next(u for u in hive.updates("T2") if u.eta)
    assert started.eta == pytest.approx(5.0 / MEAN_SPEED_SHARE)


def test_an_operator_has_a_robot_forget():
    hive = Hive()
    robot = hive.add_robot("robot1", HERE)
    hive.post(Task("T1", TaskType.GA, (A,)))
    hive.network.run(30.0)
    learned = robot.learning.experience.learned

    hive.set_state("robot1", "forget")
    hive.network.run(1.0)

    assert learned.drives == 1
    assert robot.learning.experience.is_formula


def test_a_robot_tells_what_has_changed_with_its_status():
    hive = Hive()
    robot = hive.add_robot("robot1", HERE)
    for number in range(11):
        hive.commands["robot1"].duration = lambda _, late=number > 7: 30.0 if late else 10.0
        hive.post(Task(f"T{number}", TaskType.GA, (Pose(6.0 * (-1) ** number, 0.0),)))
        hive.network.run(40.0)

    assert robot.status.reason.endswith("% more time than predicted")


def test_a_report_tells_the_margin_that_nine_of_ten_tasks_keep():
    hive = Hive()
    robot = hive.add_robot("robot1", HERE)
    hive.post(Task("T1", TaskType.GA, (A,)))
    hive.network.run(5.0)

    (started,) = [u for u in hive.updates("T1") if u.eta and u.step == 0 and u.eta_margin]
    margin = robot.learning.experience.learned.time_margin
    assert started.eta_margin == pytest.approx(margin * math.sqrt(started.eta))
    assert hive.record("T1").eta_margin == started.eta_margin


def test_bids_say_how_many_drives_they_were_learned_from_and_what_the_formula_says():
    hive = Hive()
    hive.add_robot("robot1", HERE)
    for number in range(3):
        hive.post(Task(f"T{number}", TaskType.GA, (Pose(6.0 + number, 0.0),)))
        hive.network.run(20.0)

    first, *_, last = hive.decisions
    (before,), (after,) = first.bids, last.bids
    assert (before.learned_from, after.learned_from) == (0, 2)
    assert before.duration == before.formula_duration == pytest.approx(6.0 / MEAN_SPEED_SHARE)
    assert after.formula_duration == pytest.approx(1.0 / MEAN_SPEED_SHARE)
    assert after.duration > 2.0 * after.formula_duration
    assert after.formula_energy_cost < after.energy_cost


def test_what_a_journal_holds_can_be_read_back():
    bench = Bench()
    bench.do()

    assert saved_from(bench.journal.load_experience()) == bench.told[-1]
