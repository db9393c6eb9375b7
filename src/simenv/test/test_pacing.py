# SPDX-License-Identifier: BSD-3-Clause
import pytest

from simenv.pacing import Every, Pacer

STEP = 0.025


def run(pacer, seconds, work):
    """Play a wall clock: each step takes `work` seconds; return how many ticks and steps ran."""
    now, ticks, steps = 0.0, 0, 0
    while now < seconds - 1e-9:
        steps += pacer.steps
        now += work * pacer.steps
        now += pacer.tick_done(now)
        ticks += 1
    return ticks, steps


@pytest.mark.parametrize(("factor", "steps"), [(0.1, 1), (1.0, 1), (5.0, 4), (50.0, 40)])
def test_a_tick_is_about_20_ms_on_the_wall_and_at_least_one_step(factor, steps):
    assert Pacer(factor, STEP, 0.0).steps == steps


@pytest.mark.parametrize("factor", [0.5, 1.0, 5.0])
def test_simulated_time_passes_as_fast_as_asked_whatever_a_step_takes(factor):
    pacer = Pacer(factor, STEP, 0.0)

    _, steps = run(pacer, 60.0, work=0.004)

    assert steps * STEP == pytest.approx(60.0 * factor, rel=0.01)
    assert pacer.reached is None


def test_a_machine_that_is_too_slow_falls_behind_and_it_is_said_how_far():
    pacer = Pacer(5.0, STEP, 0.0)

    _, steps = run(pacer, 30.0, work=0.01)

    assert steps == pytest.approx(30.0 / 0.01, rel=0.01)
    assert pacer.reached == pytest.approx(2.5, rel=0.02)


def test_a_machine_that_is_too_slow_tells_the_time_as_often_as_one_that_is_not():
    in_time, _ = run(Pacer(50.0, STEP, 0.0), 10.0, work=0.0001)

    too_slow, _ = run(Pacer(50.0, STEP, 0.0), 10.0, work=0.004)

    assert in_time == pytest.approx(10.0 / 0.02, rel=0.02)
    assert 10.0 / 0.02 * 0.95 < too_slow < 10.0 / 0.02 * 1.3


def test_after_a_long_halt_time_does_not_race_to_catch_up():
    pacer = Pacer(1.0, STEP, 0.0)
    pacer.tick_done(10.0)

    caught_up = sum(pacer.tick_done(10.0) == 0.0 for _ in range(100))

    assert caught_up <= 4


def test_a_short_hiccup_is_made_good():
    pacer = Pacer(1.0, STEP, 0.0)
    pacer.tick_done(0.06)

    assert pacer.tick_done(0.06) == 0.0
    assert pacer.tick_done(0.06) == pytest.approx(3 * STEP - 0.06)


def test_something_at_10_hz_is_due_every_fourth_step_of_25_ms():
    every = Every(10.0, STEP)

    due = [step for step in range(1, 13) if every.due(step * 25_000_000)]

    assert due == [4, 8, 12]


@pytest.mark.parametrize("steps", [1, 3, 4, 8, 11])
def test_what_is_looked_at_once_in_several_steps_has_come_as_often_as_it_can(steps):
    every = Every(5.0, STEP)
    looks = range(steps - 1, 8000, steps)

    come = sum(every.has_come(step * 25_000_000) for step in looks)

    assert come == pytest.approx(min(len(looks), 1000), abs=1)


def test_a_phase_shifts_what_is_due():
    due = [
        [step for step in range(1, 9) if Every(10.0, STEP, phase).due(step * 25_000_000)]
        for phase in range(4)
    ]

    assert due == [[4, 8], [3, 7], [2, 6], [1, 5]]


def test_a_rate_that_no_step_fits_is_kept_on_average():
    every = Every(15.0, STEP)

    due = sum(every.due(step * 25_000_000) for step in range(1, 4001))

    assert due == pytest.approx(1500, abs=1)


def test_nothing_is_due_more_often_than_once_a_step():
    every = Every(1000.0, STEP)

    assert all(every.due(step * 25_000_000) for step in range(1, 10))
