# SPDX-License-Identifier: BSD-3-Clause
import pytest

from simenv.pacing import Every, Lockstep, Pacer

STEP = 0.025


def run(pacer, seconds, work):
    """Play a wall clock: each step takes `work` seconds; return how many ticks and steps ran."""
    now, ticks, steps = 0.0, 0, 0
    while now < seconds - 1e-9:
        steps += pacer.steps
        now += work * pacer.steps
        now += pacer.tick_done(now, pacer.steps)
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
    pacer.tick_done(10.0, pacer.steps)

    caught_up = sum(pacer.tick_done(10.0, pacer.steps) == 0.0 for _ in range(100))

    assert caught_up <= 4


def test_a_short_hiccup_is_made_good():
    pacer = Pacer(1.0, STEP, 0.0)
    pacer.tick_done(0.06, pacer.steps)

    assert pacer.tick_done(0.06, pacer.steps) == 0.0
    assert pacer.tick_done(0.06, pacer.steps) == pytest.approx(3 * STEP - 0.06)


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


class Wall:
    """A wall clock that advances while the simulation listens; commands come at given times."""

    def __init__(self, *arrivals):
        self.now = 0.0
        self.arrivals = list(arrivals)

    def __call__(self):
        return self.now

    def listen(self, patience):
        when, hear = self.arrivals[0] if self.arrivals else (float("inf"), None)
        if when > self.now + patience:
            self.now += patience
            return
        self.arrivals.pop(0)
        self.now = when
        hear()


PERIOD = 1 / 12
DUE = 84_000_000  # after a command at time 0 [ns]


def driven(timeout=1.0, period=PERIOD, *, moves=True):
    lockstep = Lockstep(timeout)
    lockstep.note("robot1", 0, period, moves=moves)
    return lockstep


def test_simulated_time_waits_for_a_command_that_is_due():
    lockstep = driven()
    wall = Wall((0.7, lambda: lockstep.note("robot1", DUE, PERIOD, moves=True)))

    late = lockstep.wait(DUE, wall.listen, wall)

    assert (late, wall.now) == ((), 0.7)


def test_it_waits_for_every_robot_whose_command_is_due():
    lockstep = driven()
    lockstep.note("robot2", 0, PERIOD, moves=True)
    wall = Wall(
        (0.2, lambda: lockstep.note("robot2", DUE, PERIOD, moves=True)),
        (0.3, lambda: lockstep.note("robot1", DUE, PERIOD, moves=False)),
    )

    late = lockstep.wait(DUE, wall.listen, wall)

    assert (late, wall.now) == ((), 0.3)


@pytest.mark.parametrize(
    ("period", "moves"), [(PERIOD, False), (0.0, True)], ids=["at rest", "other clock"]
)
def test_it_does_not_wait_for_a_robot_at_rest_or_one_driven_by_another_clock(period, moves):
    lockstep, wall = driven(period=period, moves=moves), Wall()

    assert lockstep.wait(DUE, wall.listen, wall) == ()
    assert wall.now == 0.0


def test_a_control_loop_that_is_frozen_is_waited_for_once():
    lockstep, wall = driven(), Wall()

    late = [lockstep.wait(DUE, wall.listen, wall) for _ in range(3)]

    assert late == [("robot1",), (), ()]
    assert wall.now == pytest.approx(1.0)


def test_it_waits_longer_on_a_machine_that_does_not_keep_up():
    lockstep = driven(timeout=1.0)
    wall = Wall((3.0, lambda: lockstep.note("robot1", DUE, PERIOD, moves=True)))

    def listen(patience):
        wall.listen(patience)
        wall.now += 0.5  # without a processor

    assert lockstep.wait(DUE, listen, wall) == ()


def test_a_control_loop_that_has_ended_is_not_waited_for():
    lockstep, wall, processes = driven(), Wall(), ["control loop"]
    lockstep.note("robot1", 0, PERIOD, moves=True, is_there=lambda: bool(processes))
    wall.arrivals = [(0.3, processes.clear)]

    assert lockstep.wait(DUE, wall.listen, wall) == ()
    assert wall.now == pytest.approx(0.3)
    assert lockstep.steps_until_due(DUE, STEP, 40) == 40


def test_without_patience_it_waits_for_nobody():
    lockstep, wall = driven(timeout=0.0), Wall()

    lockstep.wait(DUE, wall.listen, wall)

    assert wall.now == 0.0


@pytest.mark.parametrize(("now", "steps"), [(0, 2), (50_000_000, 2), (75_000_000, 1), (DUE, 1)])
def test_a_tick_ends_once_a_command_is_due(now, steps):
    assert driven().steps_until_due(now, STEP, 40) == steps


def test_a_tick_is_not_cut_short_for_a_robot_that_was_removed():
    lockstep = driven()
    lockstep.forget("robot1")

    assert lockstep.steps_until_due(0, STEP, 40) == 40
