# SPDX-License-Identifier: BSD-3-Clause
"""Hives whose members crash, freeze and are cut off, with every property checked."""

import os
from collections import Counter
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose
from hive_lab.bench.faults import simulate
from hive_lab.fault_schedules.directed import DIRECTED
from hive_lab.fault_schedules.directed_over_zenoh import OVER_ZENOH
from hive_lab.fault_schedules.draw import draw
from hive_lab.fault_schedules.drawn_links import over_zenoh
from hive_lab.fault_schedules.faulty_network import Quality
from hive_lab.fault_schedules.features.exercised import FEATURES, UNDONE
from hive_lab.fault_schedules.long_run import run_with_freezes, run_with_losses
from hive_lab.fault_schedules.run import run
from hive_lab.fault_schedules.scenarios import ONE_CHARGER, STRONG_ROBOT
from hive_lab.fault_schedules.schedule import (
    BLACKBOARD,
    BY_HAND,
    BadLinks,
    Crash,
    Cut,
    FaultSchedule,
    Freeze,
    Post,
    PowerCut,
)

SCHEDULES = int(os.environ.get("HIVE_SCHEDULES", "600"))
"""Number of random schedules; more on demand."""

RECOVERED_BESIDE = "recovered beside a majority"
"""A person's mistake makes two hives, and a task of which both hear is done twice. Over Zenoh,
what is posted in this schedule waits until the second hive hears it too."""

OF_LINKS = (
    "RouterLoss",
    "connections lost",
    "deaths proved",
    "doubled",
    "held back",
    "lost with a connection",
    "no room",
    "not connected",
    "repeated",
    "repeated packets",
)
"""What links over Zenoh do to messages and members."""

DEFECTS = (2023, 941, 3073, 3153, 7979, 11520, 23918, 26734, 35199, 35345, 37535, 54852, 68373)

POSTS = tuple(
    Post(8.0 + 3.0 * number, Task(f"T{number}", TaskType.GAB, (Pose(1.0, 2.0), Pose(number, 4.0))))
    for number in range(4)
)


def schedule(*happenings, robots=3, seed=1):
    """Return a schedule with a few tasks."""
    return FaultSchedule(seed, robots, (*POSTS, *happenings))


@pytest.fixture(scope="module")
def outcomes():
    """Return what came of the random schedules."""
    return tuple(simulate(range(SCHEDULES)))


@pytest.mark.slow
@pytest.mark.timeout(1800)  # 50 s on two idle processors, of which there may be none
@pytest.mark.xdist_group("random schedules")
def test_random_schedules_break_no_property(outcomes):
    broken = [outcome for outcome in outcomes if outcome.violation]

    assert not broken, broken[0].in_full()


@pytest.mark.slow
@pytest.mark.timeout(1800)  # as above
@pytest.mark.xdist_group("random schedules")
def test_random_schedules_use_every_feature_in_one_of_fifty(outcomes):
    used = Counter(feature for outcome in outcomes for feature in outcome.exercised)
    rare = {feature: used[feature] for feature in FEATURES if used[feature] < SCHEDULES / 50}

    assert not rare


@pytest.mark.slow
@pytest.mark.timeout(1800)  # as above
def test_random_schedules_with_learners_break_no_property():
    drawn = [draw(seed) for seed in range(60)]
    aside = [tuple(f"robot{n}" for n in range(3, each.robots + 1)) for each in drawn]
    outcomes = [run(replace(each, aside=names)) for each, names in zip(drawn, aside, strict=True)]
    broken = [outcome for outcome in outcomes if outcome.violation]

    assert not broken, broken[0].in_full()


@pytest.mark.slow
@pytest.mark.timeout(900)  # 20 s on two idle processors, of which there may be none
def test_over_zenoh_random_schedules_break_no_property_and_use_what_its_links_do():
    outcomes = tuple(simulate(range(SCHEDULES // 4), zenoh=True))
    broken = [outcome for outcome in outcomes if outcome.violation]
    assert not broken, broken[0].in_full()

    used = Counter(kind for outcome in outcomes for kind in outcome.faults)
    assert not {kind: used[kind] for kind in OF_LINKS if used[kind] < len(outcomes) / 50}


@pytest.mark.parametrize("name", sorted(OVER_ZENOH))
def test_over_zenoh_what_was_written_by_hand_breaks_no_property_either(name):
    outcome = run(OVER_ZENOH[name])

    assert not outcome.violation, outcome.in_full()


@pytest.mark.parametrize("name", sorted(DIRECTED.keys() - {RECOVERED_BESIDE}))
def test_over_zenoh_it_breaks_none_either_where_connections_fail_besides(name):
    outcome = run(over_zenoh(replace(DIRECTED[name], scenario=BY_HAND)))

    assert not outcome.violation, outcome.in_full()


@pytest.mark.parametrize("seed", DEFECTS)
def test_defects_that_schedules_have_found_stay_fixed(seed):
    outcome = run(draw(seed))

    assert not outcome.violation, outcome.in_full()


@pytest.mark.parametrize(
    ("seed", "scenario"),
    [
        *((seed, "") for seed in (2173, 5106, 5428, 40853, 43552, 53731)),
        *((seed, "") for seed in (8400027, 8400404)),
        *((seed, "lost disks") for seed in (25, 47, 479)),
    ],
)
def test_robots_that_come_back_take_no_load_twice_or_for_another(seed, scenario):
    outcome = run(draw(seed, scenario))

    assert not outcome.violation, outcome.in_full()


@pytest.mark.parametrize("seed", [15676, 26082, 89483])
def test_what_robots_still_do_for_a_forgotten_task_is_told_from_a_new_one_of_its_id(seed):
    outcome = run(draw(seed))

    assert not outcome.violation, outcome.in_full()


def test_tasks_wait_for_a_person_when_a_robot_that_is_gone_blocks_the_only_charger():
    outcome = run(draw(9915))

    assert (outcome.violation, outcome.ended["WAITING"]) == ("", 15)


def test_a_robot_whose_answer_was_lost_is_asked_again_where_few_are_asked_first():
    outcome = run(draw(3171, "lost disks"))

    assert not outcome.violation, outcome.in_full()


def test_a_hive_without_a_leader_makes_a_smaller_one_give_way():
    drawn = (replace(DIRECTED["second hive"], seed=seed) for seed in range(12))
    broken = [outcome for outcome in map(run, drawn) if outcome.violation]

    assert not broken, broken[0].in_full()


@pytest.mark.parametrize("seed", [54191, 54286, 71397, 75192])
def test_hives_that_lose_disks_or_one_of_two_voters_are_one_hive_in_the_end(seed):
    outcome = run(draw(seed))

    assert not outcome.violation, outcome.in_full()


def test_a_person_recovers_hives_of_which_no_majority_is_left():
    lost = [run(draw(seed, "no majority left")) for seed in (*range(12), 110, 1115)]
    by_mistake = [run(DIRECTED[name]) for name in ("recovered too soon", RECOVERED_BESIDE)]
    broken = [outcome for outcome in (*lost, *by_mistake) if outcome.violation]

    assert not broken, broken[0].in_full()
    assert sum(bool(outcome.faults["recoveries"]) for outcome in lost) > 2 * len(lost) / 3
    assert all(outcome.faults["recoveries"] for outcome in by_mistake)


@pytest.mark.parametrize(("name", "journals"), [("a busy robot", 1), (RECOVERED_BESIDE, 2)])
def test_members_of_a_hive_that_waits_for_a_person_are_ended_and_join_the_other(name, journals):
    outcome = run(DIRECTED[name])

    assert not outcome.violation, outcome.in_full()
    assert outcome.faults["journals moved away"] == journals


def test_full_and_slow_disks_break_no_property():
    outcomes = [run(draw(seed, "bad disks")) for seed in (*range(12), 54)]
    broken = [outcome for outcome in outcomes if outcome.violation]

    assert not broken, broken[0].in_full()


def test_disks_that_lose_with_the_power_what_they_confirmed_break_no_property():
    outcomes = [run(draw(seed, "lying disks")) for seed in range(24)]
    broken = [outcome for outcome in outcomes if outcome.violation]

    assert not broken, broken[0].in_full()
    assert sum(bool(outcome.faults["writes lost"]) for outcome in outcomes) > 3


def test_splits_that_are_undone_break_no_property():
    outcomes = [run(draw(seed, STRONG_ROBOT)) for seed in range(24)]
    broken = [outcome for outcome in outcomes if outcome.violation]

    assert not broken, broken[0].in_full()
    assert sum(bool(outcome.exercised[UNDONE]) for outcome in outcomes) > len(outcomes) / 3


def test_robots_that_share_a_charger_break_no_property():
    outcomes = [run(draw(seed, ONE_CHARGER)) for seed in (*range(24), 796)]
    broken = [outcome for outcome in outcomes if outcome.violation]

    assert not broken, broken[0].in_full()
    assert all(outcome.exercised["charging"] for outcome in outcomes)


def test_machines_that_sleep_break_no_property():
    outcomes = [run(draw(seed, "sleeping machines")) for seed in range(12)]
    broken = [outcome for outcome in outcomes if outcome.violation]

    assert not broken, broken[0].in_full()
    assert sum(outcome.takeovers for outcome in outcomes) > len(outcomes)


def test_without_faults_the_first_leader_stays_and_every_task_is_done():
    outcome = run(schedule())

    assert (outcome.violation, outcome.takeovers, outcome.ended) == ("", 1, {"DONE": 4})


def test_a_crash_of_the_active_one_costs_one_takeover():
    outcome = run(schedule(Crash(12.0, BLACKBOARD, back_after=10.0)))

    assert (outcome.violation, outcome.takeovers, outcome.ended) == ("", 2, {"DONE": 4})


def test_learners_keep_working_through_a_takeover_by_a_voter():
    aside = tuple(f"robot{number}" for number in range(3, 9))
    crash = schedule(Crash(12.0, BLACKBOARD, back_after=60.0), robots=8)
    outcome = run(replace(crash, aside=aside))

    assert (outcome.violation, outcome.takeovers, outcome.ended) == ("", 2, {"DONE": 4})


def test_a_freeze_of_five_seconds_costs_one_takeover():
    outcome = run(schedule(Freeze(12.0, BLACKBOARD, lasts=5.0)))

    assert (outcome.violation, outcome.takeovers, outcome.ended) == ("", 2, {"DONE": 4})


def test_a_short_freeze_costs_none():
    outcome = run(schedule(Freeze(12.0, BLACKBOARD, lasts=0.4)))

    assert (outcome.violation, outcome.takeovers) == ("", 1)


def test_a_follower_that_is_cut_off_and_comes_back_disturbs_nobody():
    outcome = run(schedule(Cut(12.0, ("robot2",), lasts=9.0)))

    assert (outcome.violation, outcome.takeovers) == ("", 1)


@pytest.mark.parametrize("loss", [0.01, 0.3])
def test_half_an_hour_of_losses_costs_no_takeover(loss):
    found = run_with_losses(hours=0.5, loss=loss, seed=2)

    assert (found.takeovers, found.rivals) == ((0,), 0)


def test_each_of_twenty_freezes_costs_one_takeover_and_never_brings_two_leaders():
    found = run_with_freezes(20, lasts=5.0, seed=2)

    assert (found.takeovers, found.rivals) == ((1,) * 20, 0)
    assert max(found.gaps) < 1.0


def test_lost_messages_alone_cost_no_takeover():
    outcome = run(schedule(BadLinks(6.0, 36.0, Quality(loss=0.2))))

    assert (outcome.violation, outcome.takeovers) == ("", 1)


def test_after_a_power_cut_of_all_the_same_list_goes_on():
    outcome = run(schedule(PowerCut(13.0, lasts=2.0)))

    assert (outcome.violation, outcome.ended) == ("", {"DONE": 4})


TIMES = st.floats(6.0, 40.0).map(lambda at: round(at, 2))
MEMBERS = st.sampled_from([BLACKBOARD, "robot1", "robot2", "robot3"])
FAULTS = st.one_of(
    st.builds(Crash, TIMES, MEMBERS, st.sampled_from([0.1, 1.0, 4.0])),
    st.builds(Freeze, TIMES, MEMBERS, st.sampled_from([0.8, 3.0, 12.0])),
    st.builds(Cut, TIMES, MEMBERS.map(lambda name: (name,)), st.just(6.0), st.booleans()),
    st.builds(PowerCut, TIMES, st.just(1.0)),
)


@settings(max_examples=40)
@given(st.lists(FAULTS, max_size=6), st.integers(0, 99))
def test_no_sequence_of_faults_breaks_a_property(faults, seed):
    outcome = run(schedule(*faults, seed=seed))

    assert not outcome.violation, outcome.in_full()
