# SPDX-License-Identifier: BSD-3-Clause
"""When vehicles go on, and what those of a simulation wait for."""

import pytest

pytest.importorskip("rospy")

import rospy

from hive_navigation.control.catching_up import RECENT
from vda5050.ros.vehicle_link import CONTROL_PERIOD, keep_stepping, round_at

STEP = 25_000_000  # of the simulator [ns]


def test_a_round_begins_in_the_very_step_that_its_command_is_due_in():
    rounds = [round_at(number * STEP * 1e-9) for number in range(40_000)]

    assert rounds == [number // 4 for number in range(40_000)]


class Loop:
    """The clock of ROS and what vehicles hear, until so many steps were made.

    Attributes:
        now: The time of ROS [s].
        measured: When the pose was that was heard last [s].
        poses: Those that are still to come, one whenever the loop listens: when they were [s].
    """

    def __init__(self, monkeypatch, steps):
        self.now, self.measured, self.poses = 0.0, 0.0, []
        self.stepped = []
        self._steps = steps
        monkeypatch.setattr(rospy, "get_time", lambda: self.now)
        monkeypatch.setattr(rospy, "is_shutdown", lambda: len(self.stepped) == self._steps)

    def wait(self, _timeout):
        if self.poses:
            self.measured = self.poses.pop(0)
        else:
            self.now += CONTROL_PERIOD

    def step(self, now):
        self.stepped.append((round(now, 3), self.measured))


def test_a_vehicle_goes_on_once_a_period(monkeypatch):
    loop = Loop(monkeypatch, steps=3)

    keep_stepping([loop.step], loop)

    assert [now for now, _ in loop.stepped] == [0.1, 0.2, 0.3]


def test_a_vehicle_in_a_simulation_waits_for_where_it_is(monkeypatch):
    loop = Loop(monkeypatch, steps=2)

    def recent_until():
        if loop.now > 5.0 and not loop.poses and loop.measured < 5.0:
            loop.poses = [1.0, 4.0, 5.0]
        return {"pose": loop.measured + RECENT}

    def step(now):
        loop.step(now)
        loop.now = 4.95  # time has gone on, and the pose has not come yet

    keep_stepping([step], loop, recent_until)

    assert loop.stepped[1] == (pytest.approx(5.05), 5.0)
