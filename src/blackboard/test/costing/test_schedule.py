# SPDX-License-Identifier: BSD-3-Clause
"""The order of a robot's schedule, and what a task takes: figures by hand on a straight road."""

from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from blackboard.costing.effort import Predictor
from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.costing.experience import MEAN_SPEED_SHARE
from blackboard.costing.insertion import Aging
from blackboard.costing.schedule import Entry, Schedule
from blackboard.domain.record import Order
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose
from hive_lab.allocation.testing import figures, on_a_road
from hive_lab.virtual.hive import SMALL_ROBOT

HERE = Pose(0.0, 0.0)
LENGTHS = EuclideanLengths()
# 50 kg, Cf = 0.02, 1 m/s at most, of which 60 % in the mean; 20 W all the time, 100 W for the arm.
ROBOT = SMALL_ROBOT
PREDICTOR = Predictor(ROBOT, LENGTHS)


def go(name, x, priority=0):
    """Return a task to go to a place on the x axis."""
    return Task(name, TaskType.GA, (Pose(x, 0.0),), priority)


def listed(*tasks, keep_first=False):
    """Return a schedule that was given some tasks one after the other."""
    schedule = Schedule(ROBOT, LENGTHS)
    for task in tasks:
        schedule.insert(Order(task, "robot1"), HERE, keep_first=keep_first)
    return schedule


def ids(schedule):
    """Return the ids of the tasks on a schedule, in their order."""
    return [entry.task.id for entry in schedule]


def test_a_drive_takes_friction_and_idle_power_over_its_length():
    taken = PREDICTOR.effort(go("T", 12.0), 0, HERE)

    # 0.02 * 50 kg * 9.80665 m/s² * 12 m = 117.68 J; 12 m at 0.6 m/s are 20 s at 20 W = 400 J.
    assert taken.distance == pytest.approx(12.0)
    assert taken.duration == pytest.approx(20.0)
    assert taken.energy == pytest.approx(117.6798 + 400.0)
    assert taken.end == Pose(12.0, 0.0)


def test_a_load_makes_its_drive_harder_and_the_arm_takes_time_and_power():
    task = Task("T", TaskType.GPAB, (Pose(6.0, 0.0), Pose(12.0, 0.0)), payload=5.0)

    taken = PREDICTOR.effort(task, 0, HERE)

    # 6 m with 50 kg and 6 m with 55 kg; pick 5 s, place 4 s, driving 20 s.
    friction = 0.02 * 9.80665 * (50.0 * 6.0 + 55.0 * 6.0)
    assert taken.duration == pytest.approx(29.0)
    assert taken.energy == pytest.approx(friction + 100.0 * 9.0 + 20.0 * 29.0)


def test_steps_that_are_done_take_nothing():
    task = Task("T", TaskType.GPAB, (Pose(6.0, 0.0), Pose(12.0, 0.0)), payload=5.0)

    taken = PREDICTOR.effort(task, 2, Pose(6.0, 0.0))

    assert taken.distance == pytest.approx(6.0)
    assert taken.duration == pytest.approx(10.0 + 4.0)


def test_a_higher_priority_goes_before_and_a_lower_one_behind():
    schedule = listed(go("low", 1.0, 2), go("high", 9.0, 8), go("middle", 1.0, 5))

    assert ids(schedule) == ["high", "middle", "low"]


def test_among_equals_a_task_goes_where_it_lengthens_the_path_least():
    schedule = listed(go("near", 2.0), go("far", 10.0), go("between", 6.0))

    assert ids(schedule) == ["near", "between", "far"]


def test_among_equals_at_the_same_place_the_first_come_is_first():
    schedule = listed(go("first", 5.0), go("second", 5.0))

    # Going there first or second is equally far; the later task lengthens nothing behind.
    assert sorted(ids(schedule)) == ["first", "second"]


def test_what_is_under_way_keeps_its_place_before_a_higher_priority():
    schedule = listed(go("under way", 10.0, 0), go("urgent", 1.0, 10), keep_first=True)

    assert ids(schedule) == ["under way", "urgent"]


def test_what_is_not_under_way_yields_to_a_higher_priority():
    schedule = listed(go("waiting", 10.0, 0), go("urgent", 1.0, 10))

    assert ids(schedule) == ["urgent", "waiting"]


def test_an_insertion_knows_what_comes_before_it():
    schedule = listed(go("first", 6.0, 5))

    best = schedule.route(HERE, at_work=True).best_insertion(go("second", 12.0, 1), 0)

    assert best.position == 1
    assert best.before.distance == pytest.approx(6.0)
    assert best.before.end == Pose(6.0, 0.0)
    assert best.effort.distance == pytest.approx(6.0)
    assert best.added_distance == pytest.approx(6.0)


def test_a_task_on_the_path_adds_nothing_to_it():
    schedule = listed(go("far", 10.0))

    best = schedule.route(HERE, at_work=False).best_insertion(go("on the way", 4.0), 0)

    assert best.position == 0
    assert best.added_distance == pytest.approx(0.0)


def test_a_task_that_is_begun_is_counted_from_its_next_step():
    schedule = listed(Task("T", TaskType.GAB, (Pose(5.0, 0.0), Pose(9.0, 0.0))))

    schedule.advance("T", 1)

    assert schedule.ahead(Pose(5.0, 0.0))[0].distance == pytest.approx(4.0)


def test_what_lies_ahead_adds_up_task_by_task():
    schedule = listed(go("one", 6.0), go("two", 12.0))

    assert [total.distance for total in schedule.ahead(HERE)] == pytest.approx([6.0, 12.0])
    assert [total.duration for total in schedule.ahead(HERE)] == pytest.approx([10.0, 20.0])


def test_a_task_is_found_and_removed_by_its_id():
    schedule = listed(go("one", 1.0), go("two", 2.0))

    schedule.remove("one")
    schedule.remove("never there")

    assert schedule.get("one") is None
    assert schedule.first().task.id == "two"
    assert len(schedule) == 1


def test_an_empty_schedule_has_no_first_task():
    assert listed().first() is None


@given(
    st.lists(st.tuples(st.integers(-20, 20), st.integers(-20, 20)), min_size=1, max_size=6),
    st.sampled_from(["makespan", "latency"]),
)
def test_the_best_insertion_is_the_one_that_the_allocation_of_whole_fleets_finds(legs, name):
    tasks = [
        Task(f"T{index}", TaskType.GAB, (Pose(start, 0.0), Pose(end, 0.0)))
        for index, (start, end) in enumerate(legs)
    ]
    schedule = Schedule(ROBOT, LENGTHS, name)
    for task in tasks[:-1]:
        schedule.insert(Order(task, "robot1"), HERE, keep_first=False)
    starts, ends = ([task.goals[goal].x for task in tasks] for goal in (0, 1))
    instance = on_a_road([0.0], starts, ends, speed=[MEAN_SPEED_SHARE * ROBOT.max_speed])
    plan = (tuple(int(entry.task.id[1:]) for entry in schedule),)

    best = schedule.route(HERE, at_work=False).best_insertion(tasks[-1], 0)

    lists = []
    for index in range(len(tasks)):
        row = [*plan[0]]
        row.insert(index, len(tasks) - 1)
        lists.append(figures(instance, (tuple(row),))[name])
    least = min(lists) - (figures(instance, plan)[name] if name == "latency" else 0.0)
    found = best.added_waiting if name == "latency" else best.finish
    assert found == pytest.approx(least)


TASKS = st.lists(
    st.tuples(st.floats(-20.0, 20.0), st.integers(0, 10)), min_size=1, max_size=7
).map(lambda numbers: [go(f"T{i}", x, priority) for i, (x, priority) in enumerate(numbers)])


@given(TASKS)
def test_whatever_is_given_the_schedule_is_ordered_by_priority(tasks):
    priorities = [entry.task.priority for entry in listed(*tasks)]

    assert priorities == sorted(priorities, reverse=True)
    assert len(priorities) == len(tasks)


@given(TASKS)
def test_whatever_is_given_the_task_under_way_stays_first(tasks):
    schedule = listed(*tasks, keep_first=True)
    behind = [entry.task.priority for entry in schedule][1:]

    assert schedule.first().task.id == "T0"
    assert behind == sorted(behind, reverse=True)


@given(TASKS, st.floats(-20.0, 20.0))
def test_no_other_position_among_equals_lengthens_the_path_less(tasks, x):
    equals = [replace(task, priority=5) for task in tasks]
    schedule = listed(*equals)
    before = schedule.ahead(HERE)[-1].distance
    order = [entry.task for entry in schedule]

    best = schedule.route(HERE, at_work=False).best_insertion(go("new", x, 5), 0)

    added = []
    for index in range(len(order) + 1):
        road = [HERE, *(task.goals[0] for task in order)]
        road.insert(index + 1, Pose(x, 0.0))
        length = sum(a.distance_to(b) for a, b in pairwise(road))
        added.append(length - before)
    assert best.added_distance == pytest.approx(min(added), abs=1e-6)


def taken(tasks):
    """Return distance, energy, time until all are done, and the sum of their waits, from HERE."""
    distance, energy, time, waiting, here = 0.0, 0.0, 0.0, 0.0, HERE
    for task in tasks:
        own = PREDICTOR.effort(task, 0, here)
        distance, energy = distance + own.distance, energy + own.energy
        time, here = time + own.duration, own.end
        waiting += time
    return distance, energy, time, waiting


@pytest.mark.parametrize("model", ["energy", "makespan", "latency"])
@given(tasks=TASKS, x=st.floats(-20.0, 20.0))
def test_a_task_adds_what_the_schedule_takes_more_with_it_and_nowhere_less(model, tasks, x):
    order = [replace(task, priority=5) for task in tasks]
    new = Task("N", TaskType.GAB, (Pose(x, 0.0), HERE), 5)
    schedule = Schedule(ROBOT, LENGTHS, model)
    schedule.restore(Entry(Order(task, "robot1")) for task in order)

    best = schedule.route(HERE, at_work=False).best_insertion(new, 0)

    before = taken(order)
    there = taken([*order[: best.position], new, *order[best.position :]])
    assert best.added_distance == pytest.approx(there[0] - before[0], abs=1e-6)
    assert best.added_energy == pytest.approx(there[1] - before[1], abs=1e-6)
    assert best.finish == pytest.approx(there[2], abs=1e-6)
    assert best.added_waiting == pytest.approx(there[3] - before[3], abs=1e-6)
    number = {"energy": 0, "makespan": 2, "latency": 3}[model]
    others = [taken([*order[:i], new, *order[i:]])[number] for i in range(len(order) + 1)]
    assert there[number] == pytest.approx(min(others), abs=1e-5)


def test_of_equally_good_positions_a_task_takes_the_last():
    schedule = listed(go("first", 8.0))

    best = schedule.route(HERE, at_work=False).best_insertion(go("same place", 8.0), 0)

    assert best.position == 1


def test_what_has_waited_long_is_not_passed_by_what_is_new():
    def place_of_the_new(waited):
        schedule = Schedule(ROBOT, LENGTHS, "latency", Aging(lambda: 1000.0, 120.0))
        old = replace(go("old", 60.0), posted=1000.0 - waited)
        schedule.insert(Order(old, "robot1"), HERE, keep_first=False)
        new = replace(go("new", -12.0), posted=1000.0)
        return schedule.route(HERE, at_work=False).best_insertion(new, 0).position

    assert place_of_the_new(waited=0.0) == 0
    assert place_of_the_new(waited=600.0) == 1
