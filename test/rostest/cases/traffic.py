# SPDX-License-Identifier: BSD-3-Clause
"""A traffic planner guides robots; it is killed, the leader is killed, a zone closes and opens."""

import threading
import time

import pytest
import rospy
from blackboard.msg import TaskMsg, TaskState
from hive_operator import ROBOTS, Operator, slow_motion, task
from launching import kill, pid_of, run_hive
from robot_description.msg import Routes, Traffic, TrafficState

from hive_lab.runner.limits import PATIENCE

ZONE = "lower door"
CORNERS = (9.6, 2.4, 10.4, 4.0)
"""Of the zone: x and y of the lower left and the upper right corner [m]."""
WEST, EAST = (6.5, 3.2, 0.0), (13.5, 3.2, 0.0)
"""On both sides of the zone; the upper door is the other way between them."""


LOAD = 58.0
"""What the two AGVs can carry, and no mobile manipulator [kg]."""
IN_THE_DOOR = (10.0, 3.2, 0.0)


class Planned:
    """What the planner and the robots say about traffic."""

    def __init__(self):
        self.changed = threading.Condition()
        self.state = None
        self.epoch = 0
        self.followed = {}
        rospy.Subscriber("/traffic_state", TrafficState, self._note_state)
        rospy.Subscriber("/routes", Routes, self._note_routes)
        rospy.Subscriber("/traffic", Traffic, self._note_robot, queue_size=1000)

    def _note_state(self, message):
        with self.changed:
            self.state = message
            self.changed.notify_all()

    def _note_routes(self, message):
        with self.changed:
            self.epoch = max(self.epoch, message.epoch)
            self.changed.notify_all()

    def _note_robot(self, message):
        with self.changed:
            self.followed[message.name] = message.epoch
            self.changed.notify_all()

    def expect(self, condition, what):
        """Wait until a condition holds, or fail with what was expected."""
        with self.changed:
            assert self.changed.wait_for(condition, PATIENCE), (
                f"not seen: {what}; last: {self.state}, {self.epoch}, {self.followed}"
            )


@pytest.fixture(scope="module")
def operator():
    """The operator's program, once all robots were heard."""
    rospy.init_node("operator")
    operator = Operator()
    operator.expect(
        lambda: set(ROBOTS) <= set(operator.robots),
        "a status of all robots",
        lambda: sorted(operator.robots),
    )
    return operator


@pytest.fixture(scope="module")
def traffic(operator):  # noqa: ARG001  (its node)
    """The planner, once it has planned for all robots."""
    traffic = Planned()
    traffic.expect(
        lambda: traffic.state is not None and set(ROBOTS) <= set(traffic.state.robots),
        "a traffic planner that plans for all robots",
    )
    return traffic


def hive(*words):
    """Run `hive` with words; return the finished process.

    It is run again while it says that no planner answers: one that is slow may come to it later.
    """
    end = time.monotonic() + PATIENCE
    while True:
        done = run_hive(*words)
        if "no traffic planner" not in done.stderr or time.monotonic() > end:
            return done


def was_in_zone(operator, since):
    """Return the robots that have been in the zone since a time [s]."""
    left, low, right, high = CORNERS
    return {
        robot
        for robot, track in operator.tracks.items()
        for stamp, x, y in list(track)
        if stamp > since and left < x < right and low < y < high
    }


def post_crossing(operator, name):
    """Have the two AGVs drive through a door against each other."""
    operator.post(task(f"{name}1", TaskMsg.GAB, WEST, EAST, payload=LOAD))
    operator.post(task(f"{name}2", TaskMsg.GAB, EAST, WEST, payload=LOAD))
    for number in (1, 2):
        operator.until(f"{name}{number}", TaskState.STARTED)


def all_done(operator, name):
    """Return how the tasks of `post_crossing` have ended."""
    return [operator.follow(f"{name}{number}").state for number in (1, 2)]


def test_robots_follow_the_planner_s_routes_and_those_of_the_next_one_when_it_is_killed(
    operator, traffic
):
    began = rospy.get_time()

    def is_followed():
        return traffic.epoch in traffic.followed.values()

    post_crossing(operator, "A")
    traffic.expect(is_followed, "a robot that follows a route")
    with slow_motion():
        before = traffic.epoch
        kill("/traffic_planner")
        traffic.expect(lambda: traffic.epoch > before, "routes of another planner")
        traffic.expect(is_followed, "a robot that follows them")

    assert all_done(operator, "A") == [TaskState.DONE] * 2
    assert was_in_zone(operator, began)
    assert operator.collisions == 0


def test_a_zone_that_is_closed_is_driven_around(operator, traffic):
    closed = hive("zone", "close", ZONE)
    began = rospy.get_time()
    operator.post(task("C1", TaskMsg.GAB, WEST, EAST))

    assert closed.returncode == 0, closed.stderr
    assert operator.follow("C1").state == TaskState.DONE
    assert was_in_zone(operator, began) == set()
    assert list(traffic.state.closed) == [ZONE]


def test_no_robot_bids_for_a_place_in_a_closed_zone(operator, traffic):  # noqa: ARG001
    operator.post(task("F1", TaskMsg.GA, IN_THE_DOOR))

    def refusals():
        return [bids[-1].reason for bids in list(operator.bids["F1"].values())]

    operator.expect(lambda: len(refusals()) == len(ROBOTS), "bids of all robots", refusals)
    assert all("finds no path there" in reason for reason in refusals())


def test_a_zone_that_does_not_exist_is_refused_with_those_that_do(operator):  # noqa: ARG001
    refused = hive("zone", "close", "roof")

    assert refused.returncode == 2
    assert f"allowed: {ZONE}" in refused.stderr


def test_when_the_leader_is_killed_the_next_one_has_a_planner_that_knows_the_closed_zone(
    operator, traffic
):
    before = traffic.epoch
    post_crossing(operator, "D")
    with slow_motion():
        leader, planner = operator.heartbeat.active, pid_of("/traffic_planner")
        kill(leader)
        traffic.expect(lambda: traffic.epoch > before, "routes of the next leader's planner")

    assert all_done(operator, "D") == [TaskState.DONE] * 2
    assert pid_of("/traffic_planner") != planner
    assert list(traffic.state.closed) == [ZONE]
    assert operator.collisions == 0


def test_a_zone_that_is_opened_again_is_driven_through(operator, traffic):
    opened = hive("zone", "open", ZONE)
    began = rospy.get_time()
    operator.post(task("E1", TaskMsg.GAB, EAST, WEST))

    assert opened.returncode == 0, opened.stderr
    assert operator.follow("E1").state == TaskState.DONE
    assert was_in_zone(operator, began)
    assert list(traffic.state.closed) == []
    assert operator.follow("F1").state == TaskState.DONE  # it has waited for this


def test_the_command_line_shows_the_traffic(operator, traffic):  # noqa: ARG001
    shown = hive("traffic")

    assert shown.returncode == 0, shown.stderr
    assert "closed zones: none" in shown.stdout
