# SPDX-License-Identifier: BSD-3-Clause
"""A hive of real nodes when clocks jump or stop, or other programs take the processors.

The test has the machine clock of the nodes (`held_clock.py`), so a member that the machine holds
up is no reason for a takeover here.
"""

import subprocess
import sys
from pathlib import Path

import pytest
import rospy
from blackboard.msg import TaskState
from held_clock import HeldHive
from rosgraph_msgs.msg import Clock

from hive_lab.live.fake_base import FakeBase
from hive_lab.live.live_hive import ROBOTS
from hive_lab.live.live_operator import LiveOperator, make_task

NODES = Path(__file__).resolve().parents[2] / "nodes"
LONGER = 6.0
"""Longer than a lease, an election and the silence of a lost robot [s]."""
SIMULATED = 300.0
"""Limit for what hangs while a simulated clock is advanced [s, on that clock]."""
MANY = tuple(f"robot{number}" for number in range(1, 13))
GREEDY = 10
"""Programs that take all the processor time they get."""


@pytest.fixture(scope="session", autouse=True)
def ros():
    """Make this process a node."""
    rospy.init_node("faults", anonymous=True, disable_signals=True)


def make_hive(folder, namespace, robots):
    """Return a hive, not started yet, and its operator."""
    hive = HeldHive(folder, namespace, robots)
    hive.drives = [FakeBase(f"{namespace}{name}", x=float(i)) for i, name in enumerate(robots)]
    hive.operator = LiveOperator(namespace, hive.members)
    return hive, hive.operator


def arrivals(hive, goal):
    return sum(drive.arrivals.count(goal) for drive in hive.drives)


def put(path, text):
    """Write a file atomically, so that no reader finds it empty."""
    new = path.with_suffix(".new")
    new.write_text(text)
    new.replace(path)


def test_a_wall_clock_that_jumps_an_hour_changes_nothing(tmp_path):
    shift = tmp_path / "shift"
    shift.write_text("0")
    hive, operator = make_hive(tmp_path, "/wall/", ROBOTS[:2])
    for node in hive.members:
        kind = "robot_node" if hive.robot_of(node) else "blackboard_node"
        clock = [str(NODES / "jumping_clock"), f"blackboard.ros.{kind}", str(shift)]
        hive.start(node, program=clock)
    try:
        operator.wait_until_whole()
        epoch = operator.last.epoch
        for number, jump in enumerate(("3600", "-3600")):
            operator.post(make_task(f"jump{number}", (float(number), 1.0)))
            said = operator.last.header.stamp.to_sec()
            put(shift, jump)
            with hive.held():
                hive.clock.pass_time(LONGER)

            assert abs(operator.last.header.stamp.to_sec() - said) > 1800.0  # the jump was heard
            assert operator.follow(f"jump{number}") == TaskState.DONE
            assert arrivals(hive, (float(number), 1.0)) == 1
        assert operator.last.epoch == epoch
    finally:
        hive.end()


def test_ten_programs_that_take_the_processors_cost_twelve_robots_no_takeover(tmp_path):
    hive, operator = make_hive(tmp_path, "/busy/", MANY)
    greedy = []
    try:
        hive.start_all()
        operator.demand(operator.all_answer, "twelve robots answer")
        epoch = operator.last.epoch
        loop = [sys.executable, "-c", "while True: pass"]
        with hive.held():
            greedy += [subprocess.Popen(loop) for _ in range(GREEDY)]
            operator.post(make_task("busy", (1.0, 1.0)))
            hive.clock.pass_time(2 * LONGER)
            end = operator.follow("busy")

        assert end == TaskState.DONE
        assert arrivals(hive, (1.0, 1.0)) == 1
        assert operator.last.epoch == epoch
    finally:
        for program in greedy:
            program.kill()
            program.wait()
        hive.end()


def test_a_simulated_clock_that_stops_or_jumps_back_changes_nothing(tmp_path):
    rospy.set_param("/use_sim_time", True)
    clock = rospy.Publisher("/clock", Clock, queue_size=1, latch=True)
    clock.publish(rospy.Time(1000))
    hive, operator = make_hive(tmp_path, "/simulated/", ROBOTS[:2])
    try:
        hive.start_all()
        stands = run_clock(operator, clock, 1000.0, operator.is_whole)
        epoch = operator.last.epoch
        with hive.held():
            hive.clock.pass_time(LONGER)  # the simulated clock stands

        assert operator.last.epoch == epoch

        for drive in hive.drives:
            drive.seconds = 1.0  # so that the clock goes on, or jumps, while a robot drives
        for number, begins in enumerate((stands, 500.0)):
            task = f"clock{number}"
            begun = lambda t=task: operator.state_of(t) >= TaskState.STARTED  # noqa: E731  (a sentence)
            ended = lambda n=number: operator.state_of(f"clock{n}") == TaskState.DONE  # noqa: E731  (a sentence)
            with hive.held():
                operator.post(make_task(task, (float(number), 1.0)))
                operator.demand(begun, f"{task} is begun")
                run_clock(operator, clock, begins, ended)

            assert arrivals(hive, (float(number), 1.0)) == 1
        assert operator.last.epoch == epoch
    finally:
        hive.end()
        rospy.set_param("/use_sim_time", False)


def run_clock(operator, clock, begins, until):
    """Advance the simulated clock by 50 ms until a condition holds; return its time."""
    for step in range(int(SIMULATED / 0.05)):
        now = begins + 0.05 * step
        clock.publish(rospy.Time.from_sec(now))
        if operator.wait(until, 0.05):
            return now
    return pytest.fail(f"not within {SIMULATED:.0f} s of simulated time; {operator.last}")
