# SPDX-License-Identifier: BSD-3-Clause
"""The node `explorer` between what it hears and what it commands."""

from types import SimpleNamespace

import pytest

pytest.importorskip("rospy", reason="the node needs ROS")

import rospy
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry

from hive_navigation.ros import explorer_node
from hive_navigation.ros.explorer_node import QUICK, ExplorerNode

SPEED = (0.3, 0.1)


class Driver:
    """An explorer that always drives on; planning takes a while.

    Attributes:
        ages: How old the poses were by which it steered [s].
        slowness: How long planning takes [s, wall clock].
    """

    finished = False

    def __init__(self):
        self.ages = []
        self.slowness = 0.0
        self.wall = 0.0

    def steer(self, _here, age):
        self.ages.append(age)
        return SPEED

    def plan(self, _chart, _here):
        self.wall += self.slowness


class Run:
    """A node that is given odometry by hand."""

    def __init__(self, monkeypatch):
        self.driver, self.sent, self.now = Driver(), [], 0.0
        monkeypatch.setattr(rospy, "get_time", lambda: self.now)
        self.node = ExplorerNode("/", "robot1", self.driver)
        self.node._commands = SimpleNamespace(publish=self._send)  # noqa: SLF001  (made in run)
        self.node._transforms = self  # noqa: SLF001  (as above)
        self.node._chart = object()  # noqa: SLF001  (what is planned on does not matter here)
        self.mapped, self.simulated = 0.0, False
        self.comes = lambda: None
        monkeypatch.setattr(rospy.rostime, "is_wallclock", lambda: not self.simulated)
        monkeypatch.setattr(self.node._inbox, "wait", lambda _: self.comes())  # noqa: SLF001
        monkeypatch.setattr(explorer_node.time, "monotonic", lambda: self.driver.wall)

    def lookup_transform(self, *_):
        msg = TransformStamped()
        msg.header.stamp = rospy.Time.from_sec(self.now)
        msg.transform.rotation.w = 1.0
        return msg

    def get_latest_common_time(self, *_):
        return rospy.Time.from_sec(self.mapped)

    def hear(self, stamp, delay=0.0):
        """Hear odometry, some time after it was measured [s]."""
        msg = Odometry()
        msg.header.stamp = rospy.Time.from_sec(stamp)
        msg.pose.pose.orientation.w = 1.0
        self.now = stamp + delay
        self.node._drive(msg)  # noqa: SLF001  (rospy's thread does so)
        self.node._steer()  # noqa: SLF001  (its loop does so)

    def learn(self):
        """Have a new map."""
        self.node._chart_is_new = True  # noqa: SLF001  (what `_learn` does with a good one)

    def _send(self, command):
        self.sent.append((command.linear.x, command.angular.z))


@pytest.fixture
def run(monkeypatch):
    return Run(monkeypatch)


def test_a_command_goes_out_every_tenth_of_a_second_though_stamps_are_rounded(run):
    for step in range(1, 201):
        run.hear(step * 0.05)

    assert run.sent == [SPEED] * 100


def test_a_clock_that_is_set_back_does_not_silence_it(run):
    run.hear(50.0)
    run.hear(1.0)

    assert len(run.sent) == 2


def test_it_steers_with_the_age_of_its_pose_until_the_next_command(run):
    run.hear(1.0, delay=0.15)

    assert run.driver.ages == [pytest.approx(0.25)]


@pytest.mark.parametrize(("slowness", "stands"), [(QUICK / 2, False), (QUICK * 2, True)])
def test_it_stands_while_it_plans_once_that_has_taken_long(run, slowness, stands):
    run.driver.slowness = slowness
    run.learn()
    run.hear(1.0)
    run.driver.wall += 100.0
    run.learn()
    run.sent.clear()

    run.hear(1.1)

    assert run.sent == ([(0.0, 0.0)] if stands else []) + [SPEED]


def test_its_commands_say_how_often_they_come_so_that_a_simulator_waits_for_them(monkeypatch):
    made = {}
    publisher = SimpleNamespace(publish=lambda _msg: None)
    monkeypatch.setattr(
        rospy, "Publisher", lambda name, *_, **options: made.update({name: options}) or publisher
    )
    monkeypatch.setattr(explorer_node, "Transforms", lambda **_: None)
    monkeypatch.setattr(explorer_node.TopicMonitor, "subscribe", lambda *_: None)
    monkeypatch.setattr(rospy, "on_shutdown", lambda _act: None)
    monkeypatch.setattr(rospy, "is_shutdown", lambda: True)

    ExplorerNode("/", "robot1", Driver()).run()

    assert made["cmd_vel"]["headers"] == {"control_period": "0.100000"}


def map_late(run):
    """Have a mapper that was in time and then falls behind until the explorer listens."""
    waited = []

    def draw():
        waited.append(run.now)
        run.mapped = run.now

    run.comes = draw
    run.mapped = 10.0
    run.hear(10.0)
    run.hear(10.1)
    run.hear(10.3)
    return waited


def test_in_simulated_time_a_command_waits_for_the_mapper(run):
    run.simulated = True

    assert map_late(run) == [10.3]
    assert run.sent == [SPEED] * 3


def test_in_real_time_no_command_waits_for_the_mapper(run):
    assert map_late(run) == []
    assert run.sent == [SPEED] * 3
