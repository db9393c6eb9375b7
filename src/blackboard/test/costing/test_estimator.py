# SPDX-License-Identifier: BSD-3-Clause
"""A robot learns what its steps take, and notices when that has changed."""

import math
import random

import pytest

from blackboard.costing.estimator import Estimator
from blackboard.costing.experience import ENERGY_MARGIN, TIME_MARGIN, by_formula
from blackboard.costing.saved_experience import CHANGES_KEPT, as_plain, saved_from
from blackboard.costing.track_record import KEPT, Outcome
from blackboard.domain.task import StepKind
from hive_common.pose import Pose
from hive_common.structuring import NotAllowedError
from hive_lab.virtual.hive import SMALL_ROBOT

HERE = Pose(0.0, 0.0, 0.0)


def drives(number, seed=1):
    """Return drives from here: a goal, its length, and the turning [rad]."""
    chance = random.Random(seed)
    for _ in range(number):
        bearing, distance = chance.uniform(-3.0, 3.0), chance.uniform(1.0, 15.0)
        goal = Pose(distance * math.cos(bearing), distance * math.sin(bearing), bearing)
        yield goal, 1.1 * distance, abs(bearing)


def real(distance, turn, slower=1.0):
    return slower * (2.0 + 1.4 * distance + 0.6 * turn)


def estimator_after(number, slower=1.0):
    estimator = Estimator(SMALL_ROBOT)
    for goal, distance, turn in drives(number):
        estimator.learn_drive(HERE, goal, distance, real(distance, turn, slower))
    return estimator


def outcome(time=20.0, energy=500.0, predicted=20.0):
    return Outcome(0.0, 30.0, predicted, 25.0, time, 700.0, 500.0, 550.0, energy)


def test_after_ten_drives_it_knows_what_a_drive_takes():
    experience = estimator_after(10).experience

    assert not experience.is_formula
    assert experience.learned.drives == 10
    for goal, distance, turn in drives(20, seed=2):
        assert experience.duration(HERE, goal, distance) == pytest.approx(
            real(distance, turn), rel=0.03
        )


def test_a_drive_that_was_delayed_for_minutes_hardly_counts():
    estimator = estimator_after(20)
    goal = Pose(8.0, 0.0)
    before = estimator.experience.duration(HERE, goal, 8.0)

    estimator.learn_drive(HERE, goal, 8.0, before + 300.0)

    assert estimator.experience.duration(HERE, goal, 8.0) == pytest.approx(before, rel=0.05)


def test_what_traffic_costs_is_not_taken_for_the_robots_own_pace():
    estimator = Estimator(SMALL_ROBOT)
    for goal, distance, turn in drives(10):
        estimator.learn_drive(HERE, goal, distance, real(distance, turn) + 30.0, delay=30.0)

    assert estimator.experience.learned == pytest.approx(estimator_after(10).experience.learned)


@pytest.mark.parametrize(
    ("distance", "duration"), [(math.inf, 10.0), (0.1, 10.0), (3.0, 0.0), (3.0, -1.0)]
)
def test_nothing_is_learned_from_a_drive_that_says_nothing(distance, duration):
    estimator = estimator_after(5)
    before = estimator.experience.learned

    estimator.learn_drive(HERE, Pose(3.0, 0.0), distance, duration)

    assert estimator.experience.learned == before


def test_predictions_outside_of_their_limits_are_counted():
    estimator = Estimator(SMALL_ROBOT)
    for goal, distance, _ in drives(10):
        estimator.learn_drive(HERE, goal, distance, 0.01)

    assert estimator.save().clipped == 9  # all but the first, which the formula predicts


def test_it_learns_that_its_arm_is_slow():
    estimator = Estimator(SMALL_ROBOT)
    for _ in range(30):
        estimator.learn_arm(StepKind.PICK, 2.0 * SMALL_ROBOT.pick_duration)

    assert estimator.experience.arm_time(StepKind.PICK) == pytest.approx(10.0, rel=0.01)
    assert estimator.experience.arm_time(StepKind.PLACE) == SMALL_ROBOT.place_duration


def test_it_learns_that_friction_draws_more_and_electronics_less():
    estimator = Estimator(SMALL_ROBOT)
    chance = random.Random(1)
    for _ in range(30):
        friction, power = chance.uniform(50.0, 500.0), chance.uniform(50.0, 500.0)
        estimator.learn_energy(friction, power, 1.5 * friction + 0.7 * power)

    learned = estimator.experience.learned
    assert (learned.friction, learned.power) == pytest.approx((1.5, 0.7), rel=0.05)


def test_it_learns_of_energy_from_a_gauge_that_shows_whole_percents_too():
    estimator = Estimator(SMALL_ROBOT)
    shown = true = 0.0
    for _ in range(1000):
        true += 1.5 * 100.0
        rounded = 1000.0 * (true // 1000.0)
        estimator.learn_energy(80.0, 20.0, rounded - shown)
        shown = rounded

    learned = estimator.experience.learned
    assert 0.8 * learned.friction + 0.2 * learned.power == pytest.approx(1.5, rel=0.03)


def test_what_was_learned_is_the_same_after_it_was_saved():
    estimator = estimator_after(8)
    estimator.learn_arm(StepKind.PLACE, 5.0)
    estimator.learn_energy(100.0, 50.0, 180.0)
    for time in range(15, 30):
        estimator.add(outcome(time=float(time)))
    restored = Estimator(SMALL_ROBOT)
    restored.restore(saved_from(as_plain(estimator.save())))

    assert restored.save() == estimator.save()
    for each in (estimator, restored):
        each.learn_drive(HERE, Pose(5.0, 0.0), 5.0, 12.0)
        each.learn_energy(100.0, 50.0, 180.0)
    assert restored.experience.learned == estimator.experience.learned


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"learned": [1.0, 2.0]}, "learned"),
        ({"learned": ["x"] * 10}, "learned"),
        ({"of_time": [[1.0, 2.0]]}, "of_time"),
        ({"of_energy": [[1.0, 2.0], [math.nan, 1.0]]}, "of_energy"),
        ({"of_energy": [[-1.0, 0.0], [0.0, 1.0]]}, "of_energy"),
        ({"of_energy": [[1.0, 0.5], [0.0, 1.0]]}, "of_energy"),
        ({"of_energy": [[1.0], [0.0, 1.0]]}, "of_energy"),
        ({"outcomes": [[1.0]]}, "outcomes"),
        ({"clipped": -1}, "clipped"),
        ({"other": 1}, "other"),
    ],
)
def test_odd_content_is_refused_with_the_name_of_what_is_odd(changes, problem):
    content = as_plain(estimator_after(3).save()) | changes

    with pytest.raises(NotAllowedError, match=problem):
        saved_from(content)


def test_a_robot_that_joins_begins_with_the_experience_of_its_model_and_soon_has_its_own():
    others = [
        estimator_after(20).save(),
        estimator_after(60).save(),
        Estimator(SMALL_ROBOT).save(),
    ]
    joined = Estimator(SMALL_ROBOT)

    joined.begin_with(others)

    goal, distance, turn = next(drives(1, seed=3))
    taken = real(distance, turn)
    assert joined.experience.duration(HERE, goal, distance) == pytest.approx(taken, rel=0.03)
    assert joined.experience.learned.drives == pytest.approx(50)  # weighted by drives
    for goal, distance, turn in drives(12):
        joined.learn_drive(HERE, goal, distance, real(distance, turn, slower=1.2))
    goal, distance, turn = next(drives(1, seed=3))
    assert joined.experience.duration(HERE, goal, distance) == pytest.approx(1.2 * taken, rel=0.04)


def test_without_others_it_begins_with_the_formula():
    joined = Estimator(SMALL_ROBOT)

    joined.begin_with([Estimator(SMALL_ROBOT).save()])

    assert joined.experience.is_formula


def test_it_forgets_all_when_told_to():
    estimator = estimator_after(10)
    estimator.add(outcome())

    estimator.forget()

    assert estimator.save() == Estimator(SMALL_ROBOT).save()
    assert estimator.experience.learned == by_formula(SMALL_ROBOT.max_speed)


def test_nine_of_ten_tasks_keep_the_margins():
    estimator = Estimator(SMALL_ROBOT)
    chance = random.Random(5)
    within_time = within_energy = 0
    for number in range(600):
        learned = estimator.experience
        time, energy = chance.lognormvariate(3.0, 0.1), chance.lognormvariate(6.2, 0.05)
        if number >= 100:
            within_time += time <= learned.most_time(20.0)
            within_energy += energy <= learned.most_energy(500.0)
        estimator.add(outcome(time, energy))

    assert 0.87 <= within_time / 500 <= 0.93
    assert 0.87 <= within_energy / 500 <= 0.93


def test_until_there_are_enough_tasks_the_margins_are_those_of_the_formula():
    estimator = Estimator(SMALL_ROBOT)
    for _ in range(11):
        estimator.add(outcome())

    learned = estimator.experience.learned
    assert (learned.time_margin, learned.energy_margin) == (TIME_MARGIN, ENERGY_MARGIN)
    estimator.add(outcome())
    assert estimator.experience.learned.time_margin == pytest.approx(0.0)


def test_tasks_of_which_nothing_can_be_said_do_not_count():
    estimator = Estimator(SMALL_ROBOT)

    for odd in (outcome(energy=0.0), outcome(time=-1.0), outcome(predicted=math.inf)):
        estimator.add(odd)

    assert estimator.save().outcomes == ()


def test_only_the_last_tasks_are_kept():
    estimator = Estimator(SMALL_ROBOT)
    for number in range(KEPT + 5):
        estimator.add(outcome(time=20.0 + 0.001 * number))

    assert len(estimator.save().outcomes) == KEPT
    assert estimator.save().outcomes[-1][4] == pytest.approx(20.0 + 0.001 * (KEPT + 4))


def test_a_worn_wheel_is_noticed_within_three_steps_and_soon_learned():
    estimator = estimator_after(20)
    chance = random.Random(2)

    def step(factor):
        """Return what a drive draws, as a share of what was predicted."""
        friction, power = chance.uniform(50.0, 300.0), chance.uniform(200.0, 500.0)
        learned = estimator.experience.learned
        drawn = factor * friction + power
        estimator.learn_energy(friction, power, drawn)
        return drawn / (learned.friction * friction + learned.power * power)

    for _ in range(60):
        step(chance.uniform(0.97, 1.03))
    assert estimator.changes == []
    for _ in range(4):
        step(2.0)
    (text,) = estimator.changes
    assert text.startswith("after 20 drives: steps draw ")
    assert text.endswith("% more energy than predicted")
    for _ in range(6):
        step(2.0)
    assert step(2.0) == pytest.approx(1.0, abs=0.02)
    assert estimator.changes == [text]


def test_a_slower_floor_is_noticed_and_a_delay_now_and_then_is_not():
    estimator = estimator_after(20)
    for time in [20.0, 21.0, 60.0, 19.0] * 10:
        estimator.add(outcome(time=time))
    assert estimator.changes == []

    for _ in range(3):
        estimator.add(outcome(time=30.0))

    assert estimator.changes == ["after 20 drives: tasks take 50% more time than predicted"]
    assert estimator.news == estimator.changes[-1]
    for _ in range(23):
        estimator.add(outcome(time=20.0))
    assert estimator.news == ""


def test_where_errors_are_usually_large_more_of_them_are_needed_to_be_a_change():
    estimator = estimator_after(20)
    chance = random.Random(3)
    for _ in range(300):
        estimator.learn_energy(300.0, 300.0, 600.0 * chance.uniform(0.8, 1.2))

    assert estimator.changes == []
    for _ in range(12):
        estimator.learn_energy(300.0, 300.0, 900.0 * chance.uniform(0.8, 1.2))
    assert len(estimator.changes) == 1


def test_after_a_change_it_learns_anew_and_counts_no_old_task_for_its_margins():
    estimator = estimator_after(100)
    for _ in range(40):
        estimator.add(outcome(time=20.0))
    old = estimator.experience.learned.time_margin
    for _ in range(3):
        estimator.add(outcome(time=40.0))
    for goal, distance, turn in drives(8, seed=4):
        estimator.learn_drive(HERE, goal, distance, real(distance, turn, slower=2.0))

    goal, distance, turn = next(drives(1, seed=5))
    taken = real(distance, turn, slower=2.0)
    assert estimator.experience.duration(HERE, goal, distance) == pytest.approx(taken, rel=0.05)
    for _ in range(12):
        estimator.add(outcome(time=20.5))
    assert old == 0.0
    assert estimator.experience.learned.time_margin == pytest.approx(0.5 / math.sqrt(20.0))


def test_at_first_nothing_counts_as_a_change():
    estimator = estimator_after(9)
    for _ in range(8):
        estimator.add(outcome(time=40.0))
        estimator.learn_energy(100.0, 0.0, 140.0)

    assert estimator.changes == []


def test_only_the_last_changes_are_kept():
    estimator = estimator_after(20)
    for time in ([20.0] * 8 + [40.0] * 3) * 15:
        estimator.add(outcome(time=time))

    assert len(estimator.changes) == CHANGES_KEPT
