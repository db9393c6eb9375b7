# SPDX-License-Identifier: BSD-3-Clause
"""Robots with the navigation stack of ROS Noetic, one on another computer (docs/noetic-robots.md).

The only nodes on the robot's host are stand-ins that speak the stock messages; its `robot_node` is
on the fleet's computer, which is the office of the network.
"""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import rospy
from blackboard.msg import RobotStatus, TaskMsg, TaskState
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from hive_operator import Operator, task
from launching import Launches
from live_network import OFFICE, LiveNetwork, NoNetworkError
from robot_description.msg import Traffic
from visualization_msgs.msg import Marker, MarkerArray

from hive_lab.live.live_hive import own_master

NODES = Path(__file__).resolve().parents[2] / "nodes"
FLEET = Path(__file__).resolve().parents[2] / "fleets" / "stock.yaml"
STARTS = {"guest": (2.6, 2.0), "helper": (12.0, 3.0)}
SKEW = 5.0
"""How far a clock is off [s]."""


class StockRobot:
    """The two nodes of a robot, on a host."""

    def __init__(self, name, prefix, address):
        self.name, self._prefix = name, prefix
        self._where = {**os.environ, "ROS_IP": address}
        self._nodes = {}

    def start(self, kind, skew=0.0):
        place = STARTS[self.name] if kind == "base" else ()
        words = [str(NODES / "stock_robot"), kind, self.name, *map(str, place), str(skew)]
        self._nodes[kind] = subprocess.Popen(
            [*self._prefix, sys.executable, *words], env=self._where
        )

    def signal(self, kind, what):
        self._nodes[kind].send_signal(what)

    def kill(self, *kinds):
        for kind in kinds or tuple(self._nodes):
            node = self._nodes.pop(kind)
            node.kill()
            node.wait()


class Heard:
    """The messages of a topic."""

    def __init__(self, operator, topic, kind):
        self.messages = []
        operator._hear(topic, kind, self.messages.append)  # noqa: SLF001  (wakes whoever waits)

    def __iter__(self):
        return iter(list(self.messages))


@pytest.fixture(scope="module")
def robots():
    """The robots' own computers; the master is in the office."""
    try:
        network = LiveNetwork(["guest"])
    except NoNetworkError as error:
        pytest.skip(f"{error}")
    os.environ.update(ROS_MASTER_URI=f"http://{OFFICE}:11311", ROS_IP=OFFICE)
    guest = StockRobot("guest", network.prefix("guest"), network.address("guest"))
    helper = StockRobot("helper", [], OFFICE)
    try:
        yield {"guest": guest, "helper": helper}
    finally:
        guest.kill()
        helper.kill()
        network.end()


@pytest.fixture(scope="module")
def operator(robots, tmp_path_factory):
    """An operator of a hive whose robots are all there."""
    launches = Launches()
    with own_master(tmp_path_factory.mktemp("master")):
        rospy.init_node("operator", disable_signals=True)
        for robot in robots.values():
            robot.start("base")
            robot.start("move_base")
        off = dict.fromkeys(("sim", "gui", "rviz"), "false")
        launches.start("fleet_manager", "fleet_manager.launch", fleet=FLEET, map="lab", **off)
        launches.run("rosrun", "fleet_manager", "task_markers")
        operator = Operator(robots=())
        for name, topic, kind in (
            ("traffic", "traffic", Traffic),
            ("markers", "task_markers", MarkerArray),
            ("health", "/diagnostics", DiagnosticArray),
        ):
            setattr(operator, name, Heard(operator, topic, kind))
        try:
            operator.expect(lambda: set(STARTS) <= set(operator.robots), "both robots")
            operator.hear_again(*STARTS)
            yield operator
        finally:
            launches.stop()
            rospy.signal_shutdown("what follows ends the master")


def paths_shown(operator):
    """Return the paths that were drawn on the map so far."""
    drawn = [marker for array in operator.markers for marker in array.markers]
    return [m for m in drawn if m.type == Marker.LINE_STRIP and len(m.points) > 1]


def test_a_robot_with_the_stock_stack_on_another_computer_does_a_task(operator):
    operator.set_state("helper", "defect", RobotStatus.DEFECT)
    operator.post(task("N1", TaskMsg.GAB, (3.2, 2.0, 0.0), (3.2, 2.6, 0.0)))
    end = operator.follow("N1")
    operator.set_state("helper", "idle", RobotStatus.IDLE)

    assert (end.state, end.robot_id) == (TaskState.DONE, "guest")


def test_the_path_that_its_navigation_plans_is_shown(operator):
    operator.expect(lambda: paths_shown(operator), "a path on the map")

    xs = [point.x for marker in paths_shown(operator) for point in marker.points]
    assert min(xs) > 2.0


def test_it_is_announced_to_traffic_with_what_it_needs_to_stop(operator):
    said = [msg for msg in operator.traffic if msg.name == "guest"]
    moving = [msg for msg in said if msg.claim > 0]

    assert {msg.parked for msg in said} == {True}
    assert moving
    assert all(len(msg.way) == 2 for msg in moving)
    assert abs(said[0].way[0].x - STARTS["guest"][0]) < 0.1


def lose_move_base(operator, task_id, act):
    """Do something to guest's `move_base` while it drives; wait until helper has its task.

    Returns:
        The message that says that the task was handed back.
    """
    operator.post(task(task_id, TaskMsg.GA, (3.2, 9.0, 0.0)))
    assert operator.until(task_id, TaskState.STARTED).robot_id == "guest"
    updates = operator.updates[task_id]
    known = len(updates)
    act()
    operator.expect(
        lambda: any(u.state == TaskState.WAITING for u in updates[known:]),
        f"{task_id} handed back",
        lambda: operator.told(task_id),
    )
    operator.expect(
        lambda: any(u.robot_id == "helper" for u in updates[known:]),
        f"{task_id} given to the other robot",
        lambda: operator.told(task_id),
    )
    operator.cancel(task_id)
    return next(u for u in updates[known:] if u.state == TaskState.WAITING)


def complains(operator, *words):
    """Wait until guest says what it lacks, or nothing more of it."""
    operator.expect(
        lambda: (
            (reason := operator.robots["guest"].reason) == "".join(words)
            or any(word in reason for word in words)
        ),
        f"guest says '{' '.join(words)}'",
        lambda: operator.robots["guest"].reason,
    )


def test_a_move_base_that_is_killed_while_it_drives_is_noticed_and_its_task_handed_on(
    operator, robots
):
    back = lose_move_base(operator, "N2", lambda: robots["guest"].kill("move_base"))

    assert back.reason == "guest: gone: the action server move_base has ended; start it again"
    complains(operator, "has ended")


def test_a_robot_whose_move_base_is_there_again_says_no_more_of_it(operator, robots):
    robots["guest"].start("move_base")

    complains(operator)


def test_a_move_base_that_freezes_while_it_drives_is_noticed_and_its_task_handed_on(
    operator, robots
):
    guest = robots["guest"]
    back = lose_move_base(operator, "N3", lambda: guest.signal("move_base", signal.SIGSTOP))
    complains(operator, "it is frozen, or cut off")
    guest.signal("move_base", signal.SIGCONT)

    assert back.reason == (
        "guest: gone: the action server move_base has been silent for more than 2 s: "
        "it is frozen, or cut off"
    )
    complains(operator)


def test_a_robot_whose_clock_is_5_s_off_is_named(operator, robots):
    robots["guest"].kill("base")
    robots["guest"].start("base", skew=-SKEW)
    operator.expect(
        lambda: "odom" in operator.robots["guest"].reason,
        "guest says that a clock is off",
        lambda: operator.robots["guest"].reason,
    )
    shown = subprocess.run(["hive", "robots"], capture_output=True, text=True, check=False)

    row = next(line for line in shown.stdout.splitlines() if "guest" in line)
    assert "the clock that stamps its odom is 5.0 s behind its robot_node's" in row
    assert "clock" not in operator.robots["helper"].reason


def test_a_robot_node_whose_clock_is_5_s_off_is_named_by_itself_and_by_the_leader(operator):
    status = rospy.Publisher("robot_status", RobotStatus, queue_size=5)
    late = RobotStatus(robot_id="stranger", state=RobotStatus.DEFECT, charge=1.0)

    def named():
        late.header.stamp = rospy.Time.now() - rospy.Duration.from_sec(SKEW)
        status.publish(late)
        texts = [each for array in operator.health for each in array.status]
        return any(
            "the clock of stranger is 5.0 s behind mine" in each.message
            and each.level == DiagnosticStatus.WARN
            for each in texts
        )

    operator.expect(named, "a warning that names the robot")
