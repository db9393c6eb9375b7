# SPDX-License-Identifier: BSD-3-Clause
"""For what a control loop waits in simulated time, and for what it does not."""

import pytest

from hive_navigation.control.catching_up import LOOK, MOVED_ON, CatchingUp

PATIENCE = 0.8


class World:
    """Simulated time, a wall clock, and what is known; all change while somebody listens.

    Attributes:
        time: Simulated time [s].
        wall: [s]
        until: Until when each thing is recent, by its name [s].
        arrivals: What comes when on the wall clock: a time and what it does.
        stalls: For how long the process has no processor after each look [s].
    """

    def __init__(self, **until):
        self.time, self.wall, self.until = 10.0, 0.0, until
        self.arrivals = []
        self.stalls = 0.0
        self.loop = CatchingUp(lambda: self.time, lambda: self.wall, PATIENCE)

    def wait(self):
        return self.loop.wait(lambda: dict(self.until), self._listen)

    def comes(self, wall, **until):
        self.arrivals.append((wall, lambda: self.until.update(until)))

    def _listen(self, most):
        self.wall += most + self.stalls
        for due in [each for each in self.arrivals if each[0] <= self.wall]:
            self.arrivals.remove(due)
            due[1]()


def known(**until):
    """Return a world in which all was in time at first, and then its time came."""
    world = World(**dict.fromkeys(until, 20.0))
    world.wait()
    world.until = dict(until)
    return world


def test_what_is_recent_is_not_waited_for():
    world = known(scan=10.0, pose=10.1)

    assert (world.wait(), world.wall) == ((), 0.0)


def test_a_round_waits_until_all_that_is_late_has_come():
    world = known(scan=9.9, pose=9.8, robot2=10.2)
    world.comes(0.1, scan=10.05)
    world.comes(0.3, pose=10.01)

    assert world.wait() == ()
    assert world.wall == pytest.approx(0.3, abs=2 * LOOK)


def test_what_was_never_in_time_is_not_waited_for():
    world = World(scan=9.0)

    assert (world.wait(), world.wall) == ((), 0.0)


def test_a_sensor_that_has_died_is_waited_for_once():
    world = known(scan=9.0, pose=20.0)

    assert [world.wait() for _ in range(3)] == [("scan",), (), ()]
    assert world.wall == pytest.approx(PATIENCE, abs=2 * LOOK)


def test_a_round_waits_longer_on_a_machine_that_does_not_keep_up():
    world = known(scan=9.9)
    world.stalls = 0.5
    world.comes(3.0, scan=10.05)

    assert world.wait() == ()


def test_one_that_was_in_time_again_is_waited_for_again():
    world = known(scan=9.0, pose=20.0)
    world.wait()
    world.until["scan"] = 10.0
    world.wait()
    world.until["scan"] = 9.9
    begun = world.wall

    assert world.wait() == ("scan",)
    assert world.wall - begun == pytest.approx(PATIENCE, abs=2 * LOOK)


def test_what_has_gone_is_not_waited_for():
    world = known(scan=9.0)
    world.until = {}

    assert (world.wait(), world.wall) == ((), 0.0)


def test_a_wait_ends_when_time_goes_on_because_nobody_waits_for_the_robot():
    world = known(scan=9.0)
    world.arrivals.append((0.1, lambda: setattr(world, "time", 10.0 + 1.5 * MOVED_ON)))

    assert world.wait() == ()
    assert world.wall == pytest.approx(0.1, abs=2 * LOOK)


def test_what_was_late_when_time_went_on_is_waited_for_in_the_next_round():
    world = known(scan=9.0)
    world.arrivals.append((0.1, lambda: setattr(world, "time", 10.0 + 1.5 * MOVED_ON)))
    world.wait()
    world.comes(0.4, scan=10.2)

    world.wait()

    assert world.wall == pytest.approx(0.4, abs=2 * LOOK)


def test_it_waits_for_what_is_late_when_it_began_not_for_what_falls_due_meanwhile():
    world = known(scan=9.9)
    world.arrivals.append((0.1, lambda: setattr(world, "time", 10.0 + MOVED_ON / 2)))
    world.comes(0.2, scan=10.0)

    world.wait()

    assert world.wall == pytest.approx(0.2, abs=2 * LOOK)
