# SPDX-License-Identifier: BSD-3-Clause
"""When the rounds of a control loop are due, and what they wait for in simulated time."""

from types import SimpleNamespace

import pytest

pytest.importorskip("robot_description.msg", reason="the surroundings need generated messages")

import rospy

from hive_navigation.ros import surroundings
from hive_navigation.ros.surroundings import Surroundings, _Rounds
from hive_navigation.traffic.right_of_way import Announcement, no_right

PERIOD = 1 / 12
STEP = 0.025  # of the clock [s]


def rounds_at(times):
    """Return the times at which a round was done."""
    done = []
    rounds = _Rounds(PERIOD, lambda: done.append(now))
    for now in times:
        rounds.call_if_due(now)
    return done


def clock(start, seconds):
    return [start + STEP * number for number in range(round(seconds / STEP))]


def test_the_first_round_is_done_at_once_and_then_one_in_each_period():
    done = rounds_at(clock(50.01, 10.0))

    assert done[0] == 50.01
    assert len(done) == pytest.approx(120, abs=1)


def test_loops_that_begin_at_different_times_do_their_rounds_at_the_same():
    early, late = rounds_at(clock(0.0, 10.0)), rounds_at(clock(0.425, 9.575))

    assert late[1:] == pytest.approx(early[-len(late) + 1 :])


def test_rounds_at_whole_multiples_of_the_period_are_done_once_each():
    times = [number * PERIOD for number in range(1, 1000)]

    assert rounds_at(times) == times


def test_missed_rounds_are_left_out():
    assert rounds_at([1.0, 5.0, 5.01]) == [1.0, 5.0]


def test_after_the_clock_was_set_back_rounds_go_on():
    assert len(rounds_at([100.0, 3.0, 3.01, 3.1])) == 3


@pytest.fixture
def looped(monkeypatch):
    """Run a control loop for which ROS time goes by as told; return what it did at which time."""

    def run(*times):
        time = SimpleNamespace(now=times[0], left=list(times[1:]))

        def pass_time(_seconds):
            time.now = time.left.pop(0)

        for name in ("Publisher", "Subscriber"):
            monkeypatch.setattr(rospy, name, lambda *_, **__: None)
        monkeypatch.setattr(surroundings, "Transforms", lambda **_: None)
        monkeypatch.setattr(surroundings, "zones_of", lambda _: ())
        # Other tests in this process may have told rospy a simulated time.
        monkeypatch.setattr(rospy.rostime, "is_wallclock", lambda: True)
        monkeypatch.setattr(rospy, "get_time", lambda: time.now)
        monkeypatch.setattr(rospy, "is_shutdown", lambda: not time.left)
        monkeypatch.setattr(rospy, "sleep", pass_time)
        monkeypatch.setattr(rospy, "logwarn", lambda _text: None)
        loop, done = Surroundings("/"), []
        before = loop.heard
        loop.when_set_back(lambda: done.append(("anew", time.now, loop.heard is before)))
        loop.every(PERIOD, lambda: done.append(("round", time.now)))
        loop.run()
        return done

    return run


def test_when_time_is_set_back_all_is_forgotten_and_begins_anew_before_the_next_round(looped):
    assert looped(100.0, 100.1, 5.0, 5.1, 5.2) == [
        ("round", 100.0),
        ("round", 100.1),
        ("anew", 5.0, False),
        ("round", 5.0),
        ("round", 5.1),
    ]


def test_while_time_goes_on_nothing_begins_anew(looped):
    assert [what for what, *_ in looped(5.0, 5.1, 5.1, 65.0, 65.1)] == ["round"] * 3


def announced(name, time, **more):
    """Return what a robot announces that stands and has no goal, or something else."""
    standing = {"x": 0.0, "y": 0.0, "radius": 0.4, "path": ((0.0, 0.0),), "claim": 0.0}
    return Announcement(
        name=name, time=time, right=no_right(name), stationary=False, **{**standing, **more}
    )


class Changes:
    """A condition that stands for changes of the clock; `wait` is called while it is held."""

    def __init__(self, wait):
        self._wait, self._is_held = wait, False

    def __enter__(self):
        self._is_held = True

    def __exit__(self, *_):
        self._is_held = False

    def wait(self, timeout):
        assert self._is_held
        self._wait(timeout)


class Loop:
    """A control loop of robot1 that was in time at 100 s; then it is 101 s.

    Attributes:
        now: Simulated time [s].
        recent_until: What robot1 senses [s].
        done: What it did: listened, or a round.
        comes: What happens when it has listened.
    """

    def __init__(self, monkeypatch, *, simulated=True):
        self.now, self.recent_until = 100.0, {"scan": 100.0}
        self.done, self.comes = [], lambda: None
        self._rounds_left = 0
        topic = SimpleNamespace(publish=lambda _: None)
        for name in ("Publisher", "Subscriber"):
            monkeypatch.setattr(rospy, name, lambda *_, **__: topic)
        monkeypatch.setattr(surroundings, "Transforms", lambda **_: None)
        monkeypatch.setattr(surroundings, "zones_of", lambda _: ())
        monkeypatch.setattr(surroundings, "traffic_to_msg", lambda *_: None)
        monkeypatch.setattr(rospy.rostime, "is_wallclock", lambda: not simulated)
        monkeypatch.setattr(rospy, "get_time", lambda: self.now)
        monkeypatch.setattr(rospy, "is_shutdown", lambda: not self._rounds_left)
        monkeypatch.setattr(rospy, "sleep", self._sleep)
        monkeypatch.setattr(rospy.rostime, "get_rostime_cond", lambda: Changes(self._sleep))
        self.surroundings = Surroundings("/")
        monkeypatch.setattr(self.surroundings.inbox, "wait", self._listen)
        self.surroundings.catch_up_with(lambda: dict(self.recent_until))
        self.surroundings.every(PERIOD, lambda: self.done.append("round"))

    def run(self):
        """Do the round that is due, and return what was done."""
        self._rounds_left, self.done = 1, []
        self.surroundings.run()
        return self.done

    def hear(self, announcement):
        self.surroundings.heard.hear(announcement)

    def _sleep(self, _seconds):
        self._rounds_left -= 1

    def _listen(self, _most):
        self.done.append("listened")
        self.comes()


def second_round(loop):
    """Let a second pass, in which all that robot1 senses is told; return the round then."""
    loop.run()
    loop.now, loop.recent_until = 101.0, {"scan": 101.0}
    return loop.run()


def test_in_simulated_time_a_round_waits_for_what_its_robot_senses(monkeypatch):
    loop = Loop(monkeypatch)
    loop.run()
    loop.now = 101.0
    loop.comes = lambda: loop.recent_until.update(scan=101.0)

    assert loop.run() == ["listened", "round"]


def test_nothing_is_waited_for_while_no_round_is_due(monkeypatch):
    loop = Loop(monkeypatch)
    loop.run()
    loop.now += PERIOD / 4

    assert loop.run() == []


def test_in_real_time_no_round_waits(monkeypatch):
    loop = Loop(monkeypatch, simulated=False)
    loop.run()
    loop.now = 101.0

    assert loop.run() == ["round"]


@pytest.mark.parametrize(
    "more",
    [{"goal": (5.0, 0.0)}, {"path": ((0.0, 0.0), (1.0, 0.0))}],
    ids=["has a goal", "has a path"],
)
def test_a_round_waits_for_what_a_robot_of_another_process_announces(monkeypatch, more):
    loop = Loop(monkeypatch)
    loop.hear(announced("robot2", 100.0, **more))
    loop.comes = lambda: loop.hear(announced("robot2", 100.95, **more))

    assert second_round(loop) == ["listened", "round"]


def test_no_round_waits_for_a_robot_that_is_idle(monkeypatch):
    loop = Loop(monkeypatch)
    loop.hear(announced("robot2", 100.0))

    assert second_round(loop) == ["round"]


def test_no_round_waits_for_a_robot_that_was_silent_for_long(monkeypatch):
    loop = Loop(monkeypatch)
    loop.hear(announced("robot2", 100.0, goal=(5.0, 0.0)))
    loop.run()
    loop.now, loop.recent_until = 102.1, {"scan": 102.1}

    assert loop.run() == ["round"]


def test_no_round_waits_for_robots_of_its_own_process(monkeypatch):
    loop = Loop(monkeypatch)
    loop.surroundings.announce(announced("robot2", 100.0, goal=(5.0, 0.0)), "map")

    assert second_round(loop) == ["round"]


def test_a_loop_does_not_sleep_past_a_round_that_falls_due_while_it_goes_to_sleep(monkeypatch):
    """Simulated time goes on by 0.05 s after each look at it, up to where it waits for a round."""
    time = SimpleNamespace(now=195.0)

    def look():
        seen, time.now = time.now, min(time.now + 0.05, 195.1)
        return seen

    waits = []

    def stand_still(timeout):
        waits.append(timeout)
        assert len(waits) < 3, "it waits for a time that never comes"

    monkeypatch.setattr(rospy, "get_time", look)
    monkeypatch.setattr(rospy, "is_shutdown", lambda: False)
    monkeypatch.setattr(rospy.rostime, "is_wallclock", lambda: False)
    monkeypatch.setattr(rospy.rostime, "get_rostime_cond", lambda: Changes(stand_still))

    surroundings._sleep_until(195.0 + PERIOD)  # noqa: SLF001  (the loop calls it)

    assert time.now >= 195.0 + PERIOD


def test_a_loop_does_not_sleep_on_when_time_is_set_back(monkeypatch):
    time = SimpleNamespace(now=195.0)
    monkeypatch.setattr(rospy, "get_time", lambda: time.now)
    monkeypatch.setattr(rospy, "is_shutdown", lambda: False)
    monkeypatch.setattr(rospy.rostime, "is_wallclock", lambda: False)
    waits = []

    def set_back(timeout):
        waits.append(timeout)
        assert len(waits) == 1
        time.now = 3.0

    monkeypatch.setattr(rospy.rostime, "get_rostime_cond", lambda: Changes(set_back))

    surroundings._sleep_until(195.0 + PERIOD)  # noqa: SLF001  (the loop calls it)

    assert len(waits) == 1
