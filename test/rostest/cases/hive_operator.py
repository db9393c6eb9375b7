# SPDX-License-Identifier: BSD-3-Clause
"""An operator's program, as anybody could write it who knows the topics and messages only.

What it hears, it keeps; what it waits for, it waits for with patience, because a machine may be
busy. When that does not come, it says what it heard last. It keeps its connections as our own
programs do, because no case is about those that rospy loses.
"""

import collections
import contextlib
import math
import threading
import time

import pytest
import rospy
from blackboard.msg import (
    BbBackup,
    BbSynch,
    RobotStatus,
    TaskCost,
    TaskCostArray,
    TaskMsg,
    TaskState,
)
from geometry_msgs.msg import Pose2D
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState
from std_msgs.msg import Float64, Header, String, UInt32

from hive_common.ros.links import mend_links
from hive_lab.runner.limits import PATIENCE

ROBOTS = ("robot1", "robot2", "robot3", "robot4")
"""The lab's fleet: two AGVs, then two mobile manipulators."""
REPEAT = 1.0
"""Time after which an unanswered task is posted again [s, wall clock]."""
TERMINAL = (TaskState.DONE, TaskState.REJECTED, TaskState.CANCELLED, TaskState.FAILED)
HOME = ((2.6, 2.0, 0.0), (2.6, 4.0, 0.0))
"""Where the two AGVs start: x, y, yaw [m, m, rad, frame map]."""
TOLERANCE = 0.15
"""Largest distance from the goal [m]; move_base's own tolerance is 0.1."""
DONE_IN_ORDER = [TaskState.WAITING, TaskState.ASSIGNED, TaskState.STARTED, TaskState.DONE]
SLOW_MOTION = 0.1
"""Simulated time per real time while robots must not get far."""
STATES = ("WAITING", "ASSIGNED", "STARTED", "DONE", "REJECTED", "CANCELLED", "FAILED")


class Operator:
    """Publishes, listens and remembers.

    Args:
        hive: Namespace of the hive, ending in a slash.
        robots: Whose ground truth it looks at.

    Attributes:
        updates: All that was heard about each task, in the order in which it came.
        robots: Every robot's last status.
        statuses: Every robot's statuses, in the order in which they came.
        tracks: Every robot's true places: stamp [s], x, y [m, frame map].
        batteries: What every robot's battery said, in the order in which it came.
        bids: Each robot's bids on each task, in the order in which they came.
        heartbeat: The last word of the active blackboard.
        actives: When each active blackboard was heard first, on the wall clock [s].
        list: The newest copy of the task list: every record by the task's id.
        collisions: How many the simulator has counted.
    """

    def __init__(self, hive="/", robots=ROBOTS):
        self.changed = threading.Condition()
        self.updates = collections.defaultdict(list)
        self.robots = {}
        self.statuses = collections.defaultdict(list)
        self.tracks = collections.defaultdict(list)
        self.batteries = collections.defaultdict(list)
        self.bids = collections.defaultdict(lambda: collections.defaultdict(list))
        self.heartbeat = None
        self.actives = {}
        self.list = {}
        self._list_version = (0, 0)
        self.collisions = None
        self.new_task = rospy.Publisher(f"{hive}new_task", TaskMsg, queue_size=100)
        self.cancel_task = rospy.Publisher(f"{hive}task_cancel", String, queue_size=10)
        self._hear(f"{hive}task_state", TaskState, lambda m: self.updates[m.task_id].append(m))
        self._hear(f"{hive}robot_status", RobotStatus, self._note_robot)
        self._hear(f"{hive}task_cost", TaskCostArray, self._note_bids)
        self._hear(f"{hive}bb_backup", BbBackup, self._note_heartbeat)
        self._hear(f"{hive}bb_sync", BbSynch, self._note_list)
        self._hear("/simenv/collisions", UInt32, lambda m: setattr(self, "collisions", m.data))
        for name in robots:
            self.watch(name)
        mend_links()

    def watch(self, robot):
        """Track a robot's true places, and its battery, from now on."""
        rospy.Subscriber(f"/{robot}/ground_truth", Odometry, self._see, callback_args=robot)
        self._hear(f"/{robot}/battery_state", BatteryState, self.batteries[robot].append)

    def _hear(self, topic, kind, note):
        def noted(message):
            with self.changed:
                note(message)
                self.changed.notify_all()

        rospy.Subscriber(topic, kind, noted, queue_size=1000)

    def _note_robot(self, message):
        self.robots[message.robot_id] = message
        self.statuses[message.robot_id].append(message)

    def _note_bids(self, message):
        for bid in message.costs:
            self.bids[bid.task_id][bid.robot_id].append(bid)

    def _note_heartbeat(self, message):
        if self.heartbeat is None or self.heartbeat.active != message.active:
            self.actives[message.active] = time.monotonic()
        self.heartbeat = message

    def _note_list(self, message):
        """Take a list unless it is outdated: an earlier leader may be heard late."""
        version = (message.epoch, message.version)
        if version >= self._list_version:
            self._list_version = version
            self.list = {record.task.id: record for record in message.tasks}

    def _see(self, message, robot):
        here = message.pose.pose.position
        with self.changed:
            self.tracks[robot].append((message.header.stamp.to_sec(), here.x, here.y))
            self.changed.notify_all()

    def wait(self, condition, patience=PATIENCE):
        """Wait until a condition holds; return whether it did in time."""
        with self.changed:
            return self.changed.wait_for(condition, patience)

    def expect(self, condition, what, last=lambda: "", patience=PATIENCE):
        """Wait until a condition holds, or fail with the expectation and the last messages."""
        if not self.wait(condition, patience):
            pytest.fail(f"within {patience:g} s not seen: {what}; last heard: {last()}")

    def post(self, task):
        """Publish a task until somebody answers; return the answer.

        A robot that has begun it at once may be heard before the blackboard that took it in.
        """
        known = len(self.updates[task.id])

        def answers():
            active = self.heartbeat.active if self.heartbeat else ""
            return [u for u in self.updates[task.id][known:] if not is_report(u, active)]

        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            self.new_task.publish(task)
            if self.wait(answers, REPEAT):
                return answers()[0]
        return pytest.fail(f"nobody answered {task.id}")

    def cancel(self, task_id):
        """Cancel a task, again and again until it has ended."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            self.cancel_task.publish(String(task_id))
            if self.wait(lambda: any(u.state in TERMINAL for u in self.updates[task_id]), REPEAT):
                return
        pytest.fail(f"{task_id} has not ended after it was cancelled; {self.told(task_id)}")

    def said(self, task_id, state):
        """Return the first update of a task in a state, or None."""
        return next((u for u in list(self.updates[task_id]) if u.state == state), None)

    def until(self, task_id, state):
        """Wait for a state of a task; return its first update."""
        self.expect(
            lambda: self.said(task_id, state),
            f"{task_id} in state {STATES[state]}",
            lambda: self.told(task_id),
        )
        return self.said(task_id, state)

    def follow(self, task_id):
        """Wait for the end of a task; return what was said of its end.

        It need not be what was heard last: ROS keeps no order between the robot that says DONE and
        the blackboard that repeats an earlier state.
        """
        self.expect(
            lambda: any(u.state in TERMINAL for u in self.updates[task_id]),
            f"the end of {task_id}",
            lambda: self.told(task_id),
        )
        return next(u for u in self.updates[task_id] if u.state in TERMINAL)

    def history(self, task_id):
        """Wait until a task is done; return the states that it went through.

        ROS keeps the order of one publisher, not of several: what the blackboard said stands
        before what the robot said.
        """
        self.expect(
            lambda: set(DONE_IN_ORDER) <= {u.state for u in self.updates[task_id]},
            f"{task_id} WAITING, ASSIGNED, STARTED and DONE",
            lambda: self.told(task_id),
        )
        states = [u.state for u in sorted(self.updates[task_id], key=is_report)]
        return [s for i, s in enumerate(states) if i == 0 or states[i - 1] != s]

    def told(self, task_id):
        """Return in words what was heard about a task, newest last."""
        words = [
            f"{STATES[u.state]} {u.step}/{u.steps} {u.robot_id} {u.reason}".strip()
            for u in in_order(self.updates[task_id])
        ]
        return "; ".join(words[-6:]) or "nothing"

    def set_state(self, robot, word, state):
        """Set a robot to a state and wait until it says so.

        It says so twice: the blackboard may hear it later than this program does.
        """
        publisher = rospy.Publisher(f"/{robot}/set_state", String, queue_size=1)
        self.expect(publisher.get_num_connections, f"{robot} on set_state")
        known = len(self.statuses[robot])
        publisher.publish(String(word))
        self.expect(
            lambda: any(status.state == state for status in self.statuses[robot][known:]),
            f"{robot} in state {state} after it was set {word}",
            lambda: self.robots[robot],
        )
        self.hear_again(robot)

    def refusals(self, task_id, which=0):
        """Return each robot's reason for not doing a task; empty where it would.

        Args:
            task_id: Which task.
            which: Index of the bid; later ones may be on an offer to change hands.
        """
        self.expect(
            lambda: set(ROBOTS) <= set(self.bids[task_id]),
            f"bids of all robots on {task_id}",
            lambda: sorted(self.bids[task_id]),
        )
        return {
            robot: bids[which].reason if bids[which].cost >= TaskCost.MAX_COST else ""
            for robot, bids in sorted(self.bids[task_id].items())
        }

    def hear_again(self, *robots):
        """Wait for another status of every connected robot."""
        known = {robot: len(self.statuses[robot]) for robot in robots}
        self.expect(
            lambda: all(len(self.statuses[robot]) > number for robot, number in known.items()),
            f"another status of {', '.join(robots)}",
            lambda: {robot: self.robots.get(robot) for robot in robots},
        )

    def see_until(self, robot, stamp):
        """Wait until a robot has been seen as it was at a time or later.

        Args:
            robot: Its name.
            stamp: The time, as in a message.
        """
        self.expect(
            lambda: self.tracks[robot] and self.tracks[robot][-1][0] >= stamp.to_sec(),
            f"{robot} at {stamp.to_sec():.1f} s",
            lambda: self.tracks[robot][-1:],
        )

    def battery_since(self, robot, stamp=None):
        """Wait until a robot's battery has spoken; return its last word.

        Args:
            robot: Its name.
            stamp: The time, as in a message, after which it has to speak; None: now at the latest.
        """
        told = self.batteries[robot]
        self.expect(
            lambda: told and (stamp is None or told[-1].header.stamp > stamp),
            f"a word of {robot}'s battery" + (f" after {stamp.to_sec():.1f} s" if stamp else ""),
            lambda: told[-1:],
        )
        return told[-1]

    def place(self, robot):
        """Return where a robot stands in truth: x, y [m, frame map]."""
        return self.tracks[robot][-1][1:]

    def all_idle(self, robots=ROBOTS):
        """Wait until robots have nothing to do."""
        self.expect(
            lambda: all(
                self.robots[r].state == RobotStatus.IDLE and not self.robots[r].tasks
                for r in robots
            ),
            f"{', '.join(robots)} with nothing to do",
            lambda: {r: (self.robots[r].state, self.robots[r].tasks) for r in robots},
        )


@contextlib.contextmanager
def slow_motion(speed=SLOW_MOTION):
    """Let simulated time pass slowly meanwhile.

    What an operator does to a robot at work comes in time then, however long the machine needs
    for it.

    Args:
        speed: Simulated time per real time.
    """
    factor = rospy.Publisher("/simenv/rtf", Float64, queue_size=1)
    end = time.monotonic() + PATIENCE
    while not factor.get_num_connections():
        assert time.monotonic() < end, "no simulator listens to /simenv/rtf"
        time.sleep(0.05)  # rospy tells nobody of it
    factor.publish(speed)
    try:
        yield
    finally:
        factor.publish(rospy.get_param("/simulator/rtf"))


def task(task_id, kind, *goals, priority=0, payload=0.0, frame="map"):
    """Return a task as an operator posts it; goals are x, y, yaw [m, m, rad]."""
    return TaskMsg(
        header=Header(stamp=rospy.Time.now(), frame_id=frame),
        id=task_id,
        type=kind,
        priority=priority,
        payload=payload,
        goals=[Pose2D(*goal) for goal in goals],
    )


def sender(message):
    """Return the name of the node that published a message."""
    return message._connection_header["callerid"]  # noqa: SLF001  (rospy has no other way)


def is_report(update, active=""):
    """Return whether a robot says how far it is, which has said so as a robot only.

    Args:
        update: What was said of a task.
        active: The node that carries the blackboard, which may be the robot's own.
    """
    speaker = sender(update)
    return speaker != active and speaker.endswith(f"/{update.robot_id}/robot")


def in_order(updates):
    """Return updates by their stamps, as well as the clocks of several nodes agree."""
    return sorted(updates, key=lambda update: (update.header.stamp, update.state))


def apart(place, goal):
    """Return how far a place is from a goal [m]."""
    return math.dist(place[:2], goal[:2])
