# SPDX-License-Identifier: BSD-3-Clause
"""The member that leads keeps one traffic planner running, and only that member does."""

import itertools
import math

import pytest

from blackboard.board.planner_keeper import (
    FIRST_PAUSE,
    FRESH,
    LONGEST_PAUSE,
    MOST_WORK,
    PERIOD,
    SILENT,
    STARTS,
    STAYS,
    TIME_TO_END,
    PlannerKeeper,
    Progress,
)
from hive_common.errors import FileError


class Clock:
    """A talker of which only the time, its timer and the log are used."""

    def __init__(self):
        self.time = 0.0
        self.warnings = []
        self.look = lambda: None

    def now(self):
        return self.time

    def every(self, period, action):
        assert period == PERIOD
        self.look = action

    def warn(self, text):
        self.warnings.append(text)

    def pass_time(self, seconds):
        for _ in range(round(seconds / PERIOD)):
            self.time += PERIOD
            self.look()


class Planner:
    """A child process that does what a test says."""

    def __init__(self, epoch):
        self.epoch = epoch
        self.how = ""
        self.obeys = True
        self.steps, self.doing, self.worked = 0, "", 0.0
        self.asked = self.killed = False

    def progress(self):
        return Progress(self.steps, self.doing, self.worked)

    def ended(self):
        return self.how

    def end(self):
        self.asked = True
        if self.obeys:
            self.how = "signal 15"

    def kill(self):
        self.killed = True
        self.how = "signal 9"


class Bench:
    """A keeper, its clock, and the planners that it has started."""

    def __init__(self):
        self.clock = Clock()
        self.epoch = None
        self.started = []
        self.refuses = None
        self.is_mute = False
        self.spoken = {}
        self.told = []
        self.keeper = PlannerKeeper(
            self.clock,
            lambda: self.epoch,
            self.heard,
            self.launch,
            lambda *words: self.told.append((self.clock.time, *words)),
        )
        self.keeper.start()

    def launch(self, epoch):
        if self.refuses:
            raise self.refuses
        self.started.append(Planner(epoch))
        return self.started[-1]

    def heard(self, epoch):
        if not self.is_mute and epoch in self.running():
            self.spoken[epoch] = self.clock.time
        return self.spoken.get(epoch, -math.inf)

    def load(self, seconds, per_second=0.0, steps=0):
        """Let time pass while the newest planner takes processor time and does steps."""
        for _ in range(round(seconds)):
            self.started[-1].worked += per_second
            self.started[-1].steps += steps
            self.clock.pass_time(1.0)

    def running(self):
        return [planner.epoch for planner in self.started if not planner.how]


@pytest.fixture
def bench():
    return Bench()


def test_a_member_that_does_not_lead_starts_no_planner(bench):
    bench.clock.pass_time(60.0)

    assert bench.started == []


def test_a_member_that_begins_to_lead_starts_a_planner_of_its_epoch_at_once(bench):
    bench.epoch = 7
    bench.clock.pass_time(PERIOD)

    assert bench.running() == [7 * STARTS + 1]
    bench.clock.pass_time(60.0)
    assert len(bench.started) == 1


def test_a_member_that_stops_leading_ends_its_planner_at_once(bench):
    bench.epoch = 7
    bench.clock.pass_time(10.0)
    bench.epoch = None
    bench.clock.pass_time(PERIOD)

    assert bench.started[0].asked
    bench.clock.pass_time(60.0)
    assert bench.running() == []
    assert len(bench.started) == 1
    assert bench.clock.warnings == []


def test_a_member_that_leads_again_starts_a_planner_of_the_new_epoch(bench):
    bench.epoch = 7
    bench.clock.pass_time(10.0)
    bench.epoch = 9
    bench.clock.pass_time(PERIOD)

    assert bench.running() == [9 * STARTS + 1]


def test_a_planner_that_does_not_end_is_killed(bench):
    bench.epoch = 7
    bench.clock.pass_time(10.0)
    bench.started[0].obeys = False
    bench.epoch = None
    bench.clock.pass_time(TIME_TO_END - PERIOD)

    assert not bench.started[0].killed
    bench.clock.pass_time(2 * PERIOD)
    assert bench.started[0].killed


def test_a_planner_that_dies_is_started_again_after_a_pause(bench):
    bench.epoch = 7
    bench.clock.pass_time(10.0)
    bench.started[0].how = "signal 9"
    bench.clock.pass_time(FIRST_PAUSE)

    assert len(bench.started) == 1
    bench.clock.pass_time(2 * PERIOD)
    assert bench.running() == [7 * STARTS + 2]


def test_a_planner_that_dies_again_and_again_is_started_ever_less_often(bench):
    bench.epoch = 7
    begun = []
    for _ in range(4000):
        bench.clock.pass_time(PERIOD)
        if bench.running():
            begun.append(bench.clock.time)
            bench.started[-1].how = "exit code 1"
    pauses = [later - earlier for earlier, later in itertools.pairwise(begun)]

    assert pauses[:3] == pytest.approx([1.0, 2.0, 4.0], abs=3 * PERIOD)
    assert pauses == sorted(pauses)
    assert pauses[-1] == pytest.approx(LONGEST_PAUSE, abs=3 * PERIOD)


def test_every_planner_has_a_higher_epoch_than_those_before_it(bench):
    for epoch in (7, 8):
        bench.epoch = epoch
        for _ in range(2000):
            bench.clock.pass_time(PERIOD)
            if bench.running():
                bench.started[-1].how = "exit code 1"
    epochs = [planner.epoch for planner in bench.started]

    assert epochs == sorted(set(epochs))
    assert all(epoch < 9 * STARTS for epoch in epochs)


def test_the_log_says_once_that_a_planner_dies_again_and_again(bench):
    bench.epoch = 7
    for _ in range(4000):
        bench.clock.pass_time(PERIOD)
        if bench.running():
            bench.started[-1].how = "exit code 1"

    assert len(bench.clock.warnings) == 1
    assert "exit code 1" in bench.clock.warnings[0]


def test_a_planner_that_has_stayed_for_long_begins_with_the_first_pause_again(bench):
    bench.epoch = 7
    bench.clock.pass_time(PERIOD)
    for _ in range(3):
        bench.started[-1].how = "exit code 1"
        bench.clock.pass_time(LONGEST_PAUSE)
    bench.clock.pass_time(STAYS)
    known = len(bench.started)
    bench.started[-1].how = "signal 9"
    bench.clock.pass_time(FIRST_PAUSE + 2 * PERIOD)

    assert len(bench.started) == known + 1
    assert len(bench.clock.warnings) == 2


def test_a_planner_that_says_nothing_is_killed_and_started_again(bench):
    bench.epoch = 7
    bench.clock.pass_time(60.0)
    bench.is_mute = True
    bench.clock.pass_time(PERIOD)
    stuck = bench.started[0]
    bench.clock.pass_time(SILENT)

    assert stuck.killed
    bench.is_mute = False
    bench.clock.pass_time(FIRST_PAUSE + 2 * PERIOD)
    assert bench.running() == [7 * STARTS + 2]
    assert "silent" in bench.clock.warnings[0]


def test_a_planner_has_time_for_its_first_word(bench):
    bench.epoch, bench.is_mute = 7, True
    bench.clock.pass_time(SILENT)

    assert bench.running() == [7 * STARTS + 1]


def test_a_planner_that_is_loaded_on_a_busy_machine_is_left_alone_as_long_as_it_works(bench):
    bench.epoch, bench.is_mute = 7, True
    bench.clock.pass_time(PERIOD)
    bench.load(10 * 60.0, per_second=0.01)

    assert bench.running() == [7 * STARTS + 1]
    assert bench.clock.warnings == []


def test_a_planner_that_waits_while_it_is_loaded_is_left_alone_as_long_as_it_tells_so(bench):
    bench.epoch, bench.is_mute = 7, True
    bench.clock.pass_time(PERIOD)
    bench.load(10 * 60.0, steps=1)

    assert bench.running() == [7 * STARTS + 1]


def test_a_planner_that_gets_stuck_while_it_is_loaded_is_started_again(bench):
    bench.epoch, bench.is_mute = 7, True
    bench.clock.pass_time(PERIOD)
    bench.load(120.0, per_second=0.5, steps=1)
    bench.started[0].doing = "makes the roadmap, step 3"
    bench.clock.pass_time(SILENT + 2 * PERIOD)

    assert bench.started[0].killed
    assert "no progress for 30 s while it makes the roadmap, step 3" in bench.clock.warnings[0]


def test_a_step_of_loading_that_computes_for_ever_is_ended(bench):
    bench.epoch, bench.is_mute = 7, True
    bench.clock.pass_time(PERIOD)
    bench.load(MOST_WORK, per_second=1.0, steps=1)
    bench.load(MOST_WORK, per_second=1.0)
    assert not bench.started[0].killed
    bench.load(2.0, per_second=1.0)

    assert bench.started[0].killed
    assert "worked for 300 s without a result" in bench.clock.warnings[0]


def test_a_planner_that_dies_after_a_long_time_of_loading_is_started_ever_less_often(bench):
    bench.epoch, bench.is_mute = 7, True
    begun = []
    for _ in range(6):
        bench.clock.pass_time(PERIOD)
        while not bench.running():
            bench.clock.pass_time(PERIOD)
        begun.append(bench.clock.time)
        bench.load(2 * STAYS, per_second=0.5)
        bench.started[-1].how = "signal 9"
    pauses = [later - earlier - 2 * STAYS for earlier, later in itertools.pairwise(begun)]

    assert pauses == pytest.approx([1.0, 2.0, 4.0, 8.0, 16.0], abs=3 * PERIOD)
    assert len(bench.clock.warnings) == 1


def test_while_a_planner_is_loaded_everybody_is_told_how_far_it_is(bench):
    bench.epoch, bench.is_mute = 7, True
    bench.clock.pass_time(PERIOD)
    bench.started[0].doing = "waits for the map"
    bench.load(10.0, per_second=0.5)

    _, epochs, texts = zip(*bench.told, strict=True)
    assert set(epochs) == {7 * STARTS + 1}
    assert len(texts) == pytest.approx(10, abs=1)
    assert texts[-1] == "it has been loading for 10 s, and waits for the map"


def test_after_a_planner_has_died_everybody_is_told_how_and_when_it_is_started_again(bench):
    bench.epoch = 7
    bench.clock.pass_time(10.0)
    bench.refuses = OSError("no more processes")
    bench.started[0].how = "exit code 1"
    bench.clock.pass_time(PERIOD)
    first = bench.told[-1][2]
    bench.clock.pass_time(LONGEST_PAUSE)

    assert first == "it has ended (exit code 1), and is started again in 1 s"
    assert "it has ended (no more processes), and is started again in" in bench.told[-1][2]


def test_nobody_speaks_for_a_planner_that_plans(bench):
    bench.epoch = 7
    bench.clock.pass_time(2 * PERIOD)
    before = len(bench.told)
    bench.clock.pass_time(60.0)
    assert len(bench.told) == before
    bench.is_mute = True
    bench.clock.pass_time(FRESH + 2 * PERIOD)

    assert "silent for 3 s" in bench.told[-1][2]


def test_a_member_that_does_not_lead_tells_nothing(bench):
    bench.clock.pass_time(60.0)

    assert bench.told == []


@pytest.mark.parametrize("error", [OSError("no more processes"), FileError("no such node")])
def test_a_planner_that_cannot_be_started_is_tried_again(bench, error):
    bench.epoch, bench.refuses = 7, error
    bench.clock.pass_time(PERIOD)
    bench.refuses = None
    bench.clock.pass_time(FIRST_PAUSE + 2 * PERIOD)

    assert bench.running() == [7 * STARTS + 2]
    assert str(error) in bench.clock.warnings[0]


def test_a_member_that_ends_takes_its_planner_with_it_and_starts_no_other(bench):
    bench.epoch = 7
    bench.clock.pass_time(10.0)
    bench.keeper.stop()

    assert bench.started[0].asked
    bench.clock.pass_time(60.0)
    assert len(bench.started) == 1
