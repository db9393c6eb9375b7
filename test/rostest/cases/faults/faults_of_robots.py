# SPDX-License-Identifier: BSD-3-Clause
"""The tasks of real robot nodes that die, freeze, fail, or hear badly."""

import random
import signal
import subprocess
import sys
import threading
import time

import pytest
import rospy
from blackboard.msg import BbSynch, TaskMsg, TaskMsgArray, TaskState
from held_clock import PATIENT, STEADY

from hive_lab.live.fake_base import FakeBase
from hive_lab.live.live_hive import LiveHive
from hive_lab.live.live_operator import LiveOperator, make_task

LONG = 3600.0
"""Longer than a case lasts on any machine [s]."""
ROBOTS = ("robot1", "robot2", "robot3")


@pytest.fixture(scope="session", autouse=True)
def ros():
    """Make this process a node."""
    rospy.init_node("faults", anonymous=True, disable_signals=True)


def make_hive(folder, namespace, robots, **blackboard):
    hive = LiveHive(
        folder,
        namespace,
        robots,
        # Nobody who is slow is left out of an auction.
        blackboard={"most_hand_backs": 2, "bid_timeout": 10.0, **STEADY, **blackboard},
        robot={"retry_delay": 0.2, **PATIENT},
    )
    hive.drives = {r: FakeBase(f"{namespace}{r}", x=float(i)) for i, r in enumerate(robots)}
    hive.operator = LiveOperator(namespace, hive.members)
    return hive


@pytest.fixture(scope="session")
def hive(tmp_path_factory):
    """A hive that reassigns the tasks of lost robots."""
    hive = make_hive(tmp_path_factory.mktemp("robots"), "/robots/", ROBOTS)
    try:
        hive.start_all()
        yield hive
    finally:
        hive.end()


@pytest.fixture(scope="session")
def waiting_hive(tmp_path_factory):
    """A hive that waits for lost robots."""
    folder = tmp_path_factory.mktemp("waiting")
    hive = make_hive(folder, "/waiting/", ROBOTS[:2], on_robot_lost="wait")
    try:
        hive.start_all()
        yield hive
    finally:
        hive.end()


def ready(hive):
    """Return the operator of a hive whose members all run, answer, and stand still."""
    if hive.ended():
        hive.operator.forget_answers()
        hive.restart_ended()
    for drive in hive.drives.values():
        drive.seconds, drive.fails = 0.1, False
    hive.operator.wait_until_whole()
    known = hive.operator.robots
    idle = lambda: all(r in known and known[r].state == known[r].IDLE for r in hive.robots)  # noqa: E731  (a sentence)
    hive.operator.demand(idle, "every robot is idle")
    return hive.operator


def begin(hive, task_id, *goals):
    """Post a task with long drives; return the robot that has begun it."""
    operator = hive.operator
    for drive in hive.drives.values():
        drive.seconds = LONG
    drives = sum(drive.begun for drive in hive.drives.values())
    operator.post(make_task(task_id, *goals))
    operator.demand(
        lambda: (
            operator.state_of(task_id) == TaskState.STARTED
            and sum(drive.begun for drive in hive.drives.values()) > drives
        ),
        f"{task_id} begins, and a base drives",
    )
    return operator.record_of(task_id).robot


def let_arrive(hive):
    """Make all further drives short."""
    for drive in hive.drives.values():
        drive.seconds = 0.1


def is_said_to_be_lost(operator, task_id):
    """Return a condition: the list says that a task's robot is unheard."""

    def said():
        record = operator.record_of(task_id)
        return record is not None and "not heard of" in record.reason

    return said


def arrivals(hive, goal):
    return sum(drive.arrivals.count(goal) for drive in hive.drives.values())


def test_the_task_of_a_killed_robot_is_done_by_another_after_its_lease(hive):
    operator = ready(hive)
    first = begin(hive, "killed", (5.0, 1.0))
    let_arrive(hive)
    before = hive.drives[first].cancelled
    hive.kill(hive.node_of(first))
    operator.demand(
        lambda: any(u.robot_id not in {"", first} for u in operator.updates["killed"]),
        "another robot has the task",
    )
    moved = time.monotonic()
    leases = [
        heard + beat.robot_lease
        for _, beat in operator.beats
        for robot, heard in zip(beat.robots, beat.heard, strict=True)
        if robot == first
    ]

    assert moved > max(leases)
    operator.demand(
        lambda: hive.drives[first].cancelled > before, "its base, which had an hour, stops"
    )
    assert operator.follow("killed") == TaskState.DONE
    assert operator.record_of("killed").robot != first


def test_a_robot_that_was_frozen_beyond_its_lease_drops_what_is_no_longer_its_own(hive):
    operator = ready(hive)
    first = begin(hive, "frozen", (6.0, 1.0))
    let_arrive(hive)
    before = hive.drives[first].cancelled
    hive.freeze(hive.node_of(first))
    try:
        operator.demand(
            lambda: hive.drives[first].cancelled > before,
            "its base, which had an hour, stops",
        )
        state = operator.follow("frozen")
    finally:
        hive.thaw(hive.node_of(first))
    operator.demand(
        lambda: operator.robots[first].state == 0 and not operator.robots[first].tasks,
        f"{first} has dropped it",
    )

    assert state == TaskState.DONE
    assert operator.record_of("frozen").robot != first
    assert arrivals(hive, (6.0, 1.0)) == 1


def test_a_step_that_is_aborted_is_tried_a_few_times_and_then_failed_with_the_reason(hive):
    operator = ready(hive)
    before = sum(drive.begun for drive in hive.drives.values())
    for drive in hive.drives.values():
        drive.fails = True
    operator.post(make_task("aborted", (7.0, 1.0)))

    assert operator.follow("aborted") == TaskState.FAILED
    assert "the fake base was told to fail" in operator.record_of("aborted").reason
    assert sum(drive.begun for drive in hive.drives.values()) - before <= 3 * 3


def give_to(operator, robot, goal):
    """Post tasks near a robot that has just come until it has begun one; return its id.

    What another one begins before this one answers auctions is cancelled before it arrives.
    """
    for number in range(30):
        task_id = f"{robot}{number}"
        operator.post(make_task(task_id, goal))
        started = lambda: operator.state_of(task_id) == TaskState.STARTED  # noqa: B023, E731  (called at once; a sentence)
        operator.demand(started, f"{task_id} begins")
        if operator.record_of(task_id).robot == robot:
            return task_id
        operator.cancel(task_id)
    return pytest.fail(f"{robot} answers no auction")


def test_the_task_of_a_robot_whose_navigation_dies_is_done_by_another(hive):
    operator = ready(hive)
    robot = "lame"
    rospy.set_param(
        f"/robots/{robot}/characteristics", rospy.get_param("/robots/robot1/characteristics")
    )
    rospy.set_param(f"/robots/{robot}/robot", rospy.get_param("/robots/robot1/robot"))
    command = [
        sys.executable,
        "-m",
        "hive_lab.live.fake_base",
        f"/robots/{robot}",
        str(LONG),
        "100",
    ]
    planner = subprocess.Popen(command)
    node = hive.node_of(robot)
    try:
        for drive in hive.drives.values():
            drive.seconds = LONG
        hive.start(node)
        operator.demand(
            lambda: robot in operator.robots and node in operator.last.members, f"{robot} joins"
        )
        task = give_to(operator, robot, (100.0, 1.0))
        let_arrive(hive)
        planner.send_signal(signal.SIGKILL)

        assert operator.follow(task) == TaskState.DONE
        assert operator.record_of(task).robot != robot
        assert any("move_base has ended" in u.reason for u in operator.updates[task])
    finally:
        planner.kill()
        planner.wait()
        hive.kill(node)
        del hive._processes[node]  # noqa: SLF001  (it is not to be started again)


def test_a_lost_robot_is_waited_for_where_the_fleet_says_so_and_does_its_task_once(waiting_hive):
    operator = ready(waiting_hive)
    first = begin(waiting_hive, "waited", (5.0, 5.0))
    let_arrive(waiting_hive)
    waiting_hive.kill(waiting_hive.node_of(first))
    operator.demand(
        is_said_to_be_lost(operator, "waited"),
        "the list says that it waits",
    )
    held = operator.record_of("waited").robot
    waiting_hive.restart_ended()

    assert held == first
    assert operator.follow("waited") == TaskState.DONE
    assert operator.record_of("waited").robot == first
    assert arrivals(waiting_hive, (5.0, 5.0)) == 1


def test_the_task_of_a_robot_that_never_returns_is_released_by_an_operator(waiting_hive):
    operator = ready(waiting_hive)
    first = begin(waiting_hive, "orphan", (6.0, 5.0))
    waiting_hive.kill(waiting_hive.node_of(first))
    operator.demand(
        is_said_to_be_lost(operator, "orphan"),
        "the list says that it waits",
    )
    operator.cancel("orphan")

    assert operator.state_of("orphan") == TaskState.CANCELLED


class LateAndDouble:
    """Carries messages to one robot late, twice, and out of order.

    Args:
        hive: Namespace of the hive.
        seed: Of the delays.
    """

    TOPICS = (("task_assign", TaskMsg), ("task_bc", TaskMsgArray), ("bb_sync", BbSynch))

    def __init__(self, hive, seed):
        self.random = random.Random(seed)
        for topic, kind in self.TOPICS:
            out = rospy.Publisher(f"{hive}late/{topic}", kind, queue_size=100)
            rospy.Subscriber(f"{hive}{topic}", kind, self.carry, callback_args=out)

    @classmethod
    def remappings(cls, hive):
        return [f"{hive}{topic}:={hive}late/{topic}" for topic, _ in cls.TOPICS]

    def carry(self, message, out):
        for _ in range(2):
            timer = threading.Timer(self.random.uniform(0.0, 2.0), out.publish, [message])
            timer.daemon = True
            timer.start()


def test_orders_that_come_late_twice_and_out_of_order_are_carried_out_once(hive):
    operator = ready(hive)
    relay = LateAndDouble(hive.namespace, seed=1)
    node = hive.node_of("robot2")
    hive.kill(node)
    operator.forget_answers()
    hive.start(node, *relay.remappings(hive.namespace))
    operator.wait_until_whole()
    goals = [(float(i), 9.0) for i in range(8)]
    for i, goal in enumerate(goals):
        operator.post(make_task(f"late{i}", goal))

    assert {operator.follow(f"late{i}") for i in range(8)} == {TaskState.DONE}
    assert [arrivals(hive, goal) for goal in goals] == [1] * 8
    hive.kill(node)


def test_a_robot_that_missed_thousands_of_messages_ends_with_the_newest_list(hive):
    operator = ready(hive)
    node = next(
        hive.node_of(r)
        for r in ROBOTS
        if hive.node_of(r) not in {operator.last.active, operator.last.backup}
    )
    hive.freeze(node)
    try:
        for number in range(2000):
            operator.post_once(make_task(f"flood{number % 20}", (1.0, float(number % 20))))
        ended = {operator.follow(f"flood{number}") for number in range(20)}
    finally:
        hive.thaw(node)
    operator.demand(
        lambda: operator.acknowledged.get(node, 0) == operator.last.version, f"{node} has it all"
    )

    assert ended == {TaskState.DONE}
