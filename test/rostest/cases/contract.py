# SPDX-License-Identifier: BSD-3-Clause
"""What any program can do that knows the topics and messages only: post tasks and follow them.

Nothing of the system is imported here but its messages.
"""

import collections
import math
import threading
import time

import pytest
import rospy
from blackboard.msg import RobotStatus, TaskMsg, TaskState
from geometry_msgs.msg import Pose2D
from nav_msgs.msg import Odometry
from std_msgs.msg import Header, String, UInt32

ROBOTS = ("robot1", "robot2", "robot3", "robot4")
PATIENCE = 120.0
"""Wall time that a machine with two busy cores may take for anything [s]."""
REPEAT = 1.0
"""Wall time after which a task that nobody has answered is posted again [s]."""
TERMINAL = (TaskState.DONE, TaskState.REJECTED, TaskState.CANCELLED, TaskState.FAILED)
TOLERANCE = 0.15


class Operator:
    """A program of somebody else: it publishes, listens and remembers."""

    def __init__(self):
        rospy.init_node("operator")
        self.changed = threading.Condition()
        self.updates = collections.defaultdict(list)
        self.robots = {}
        self.places = {}
        self.collisions = None
        self.new_task = rospy.Publisher("/new_task", TaskMsg, queue_size=10)
        self.cancel_task = rospy.Publisher("/task_cancel", String, queue_size=10)
        rospy.Subscriber("/task_state", TaskState, self.hear_update)
        rospy.Subscriber("/robot_status", RobotStatus, self.hear_robot)
        rospy.Subscriber("/simenv/collisions", UInt32, self.count)
        for name in ROBOTS:
            rospy.Subscriber(f"/{name}/ground_truth", Odometry, self.see, callback_args=name)

    def hear_update(self, msg):
        with self.changed:
            self.updates[msg.task_id].append(msg)
            self.changed.notify_all()

    def hear_robot(self, msg):
        with self.changed:
            self.robots[msg.robot_id] = msg
            self.changed.notify_all()

    def count(self, msg):
        with self.changed:
            self.collisions = msg.data
            self.changed.notify_all()

    def see(self, msg, name):
        self.places[name] = msg.pose.pose.position

    def wait(self, condition, patience=PATIENCE):
        with self.changed:
            return self.changed.wait_for(condition, patience)

    def post(self, task):
        """Publish a task until somebody answers; return the answer."""
        known = len(self.updates[task.id])
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            self.new_task.publish(task)
            if self.wait(lambda: len(self.updates[task.id]) > known, REPEAT):
                return self.updates[task.id][known]
        pytest.fail(f"nobody answered {task.id}")

    def follow(self, task_id):
        """Wait for the end of a task; return all that was said about it."""
        ended = self.wait(lambda: any(u.state in TERMINAL for u in self.updates[task_id]))
        assert ended, f"{task_id} has not ended; last heard: {self.updates[task_id][-1:]}"
        return self.updates[task_id]


@pytest.fixture(scope="session")
def operator():
    operator = Operator()
    there = operator.wait(lambda: set(ROBOTS) <= set(operator.robots))
    assert there, f"heard of {sorted(operator.robots)} only"
    return operator


def task(task_id, kind, *goals, priority=0, payload=0.0, frame="map"):
    return TaskMsg(
        header=Header(stamp=rospy.Time.now(), frame_id=frame),
        id=task_id,
        type=kind,
        priority=priority,
        payload=payload,
        goals=[Pose2D(*goal) for goal in goals],
    )


def without_repetitions(updates):
    """Return the states by their stamps: ROS keeps no order between two publishers of a topic."""
    in_order = sorted(updates, key=lambda update: (update.header.stamp, update.state))
    states = [update.state for update in in_order]
    return [s for i, s in enumerate(states) if i == 0 or states[i - 1] != s]


def test_a_task_of_every_type_is_done_with_its_states_in_order(operator):
    tasks = [
        task("C1", TaskMsg.GA, (5.5, 4.0, 1.57)),
        task("C2", TaskMsg.GAB, (3.6, 5.2, 0.0), (7.4, 8.6, 0.0), priority=3, payload=20.0),
        task("C3", TaskMsg.GPA, (13.6, 8.8, 0.0), payload=0.3),
        task("C4", TaskMsg.GPAB, (12.0, 5.6, 0.0), (16.5, 6.0, 0.0), payload=2.0),
    ]
    for each in tasks:
        assert operator.post(each).state == TaskState.WAITING
    for each in tasks:
        said = operator.follow(each.id)

        assert without_repetitions(said) == [
            TaskState.WAITING,
            TaskState.ASSIGNED,
            TaskState.STARTED,
            TaskState.DONE,
        ]
        assert len({update.robot_id for update in said if update.robot_id}) == 1
        steps = [update.step for update in said if update.state == TaskState.STARTED]
        assert steps == sorted(steps)
        assert said[-1].step == said[-1].steps


def test_the_robot_that_did_a_task_stands_at_its_last_goal(operator):
    operator.post(task("G1", TaskMsg.GA, (2.2, 9.0, 0.0)))
    robot = operator.follow("G1")[-1].robot_id
    place = operator.places[robot]

    assert math.hypot(place.x - 2.2, place.y - 9.0) < TOLERANCE


def test_what_only_an_arm_can_do_goes_to_a_robot_that_has_one(operator):
    for number in range(3):
        operator.post(task(f"A{number}", TaskMsg.GPA, (14.0, 5.4, 0.0), payload=0.2))

    robots = {operator.follow(f"A{number}")[-1].robot_id for number in range(3)}
    assert robots <= {"robot3", "robot4"}


def test_the_same_task_posted_again_is_the_same_task(operator):
    again = task("S1", TaskMsg.GA, (8.8, 3.2, 0.0))
    operator.post(again)
    operator.follow("S1")
    operator.post(again)

    # The blackboard's last STARTED may come after the robot's DONE.
    operator.wait(lambda: operator.updates["S1"][-1].state == TaskState.DONE)
    assert operator.updates["S1"][-1].state == TaskState.DONE
    assert [u.state for u in operator.updates["S1"]].count(TaskState.WAITING) == 1


def test_a_taken_id_with_other_content_is_refused_and_the_task_goes_on(operator):
    operator.post(task("S2", TaskMsg.GA, (8.8, 3.2, 0.0)))
    other = task("S2", TaskMsg.GA, (2.2, 9.0, 0.0))
    operator.new_task.publish(other)

    refused = operator.wait(
        lambda: any(u.state == TaskState.REJECTED for u in operator.updates["S2"])
    )
    assert refused
    assert operator.wait(lambda: any(u.state == TaskState.DONE for u in operator.updates["S2"]))


BAD = {
    "unknown-type": ((9, (5.5, 4.0, 0.0)), {}, "type 9"),
    "too-few-goals": ((TaskMsg.GAB, (5.5, 4.0, 0.0)), {}, "1 goal"),
    "no-goals": ((TaskMsg.GA,), {}, "0 goals"),
    "nan": ((TaskMsg.GA, (math.nan, 4.0, 0.0)), {}, "nan"),
    "infinite-heading": ((TaskMsg.GA, (5.5, 4.0, math.inf)), {}, "inf"),
    "outside-the-map": ((TaskMsg.GA, (99.0, 4.0, 0.0)), {}, "outside the map"),
    "inside-a-wall": ((TaskMsg.GA, (10.0, 11.0, 0.0)), {}, "wall"),
    "negative-payload": ((TaskMsg.GA, (5.5, 4.0, 0.0)), {"payload": -1.0}, "payload -1"),
    "nan-payload": ((TaskMsg.GA, (5.5, 4.0, 0.0)), {"payload": math.nan}, "payload nan"),
    "priority-11": ((TaskMsg.GA, (5.5, 4.0, 0.0)), {"priority": 11}, "priority 11"),
    "unknown-frame": ((TaskMsg.GA, (5.5, 4.0, 0.0)), {"frame": "moon"}, "moon"),
}


@pytest.mark.parametrize("what", BAD)
def test_a_bad_task_is_rejected_with_a_reason_that_names_what_is_wrong(operator, what):
    arguments, options, said = BAD[what]
    answer = operator.post(task(what, *arguments, **options))

    assert answer.state == TaskState.REJECTED
    assert said in answer.reason


def test_a_cancelled_task_ends_at_once_and_its_robot_is_free_again(operator):
    operator.post(task("X1", TaskMsg.GAB, (2.2, 9.0, 0.0), (5.5, 4.0, 0.0), (2.2, 9.0, 0.0)))
    assert operator.wait(lambda: any(u.state == TaskState.STARTED for u in operator.updates["X1"]))
    robot = next(u.robot_id for u in operator.updates["X1"] if u.robot_id)
    operator.cancel_task.publish(String("X1"))

    assert operator.follow("X1")[-1].state == TaskState.CANCELLED
    assert operator.wait(lambda: operator.robots[robot].state == RobotStatus.IDLE)
    assert operator.robots[robot].tasks == []


def test_after_all_that_no_robot_has_touched_anything(operator):
    assert operator.wait(lambda: operator.collisions is not None)
    assert operator.collisions == 0
