# SPDX-License-Identifier: BSD-3-Clause
"""Measures how fast the node `simulator` lets time pass.

`live.simulator` runs it as `python3 -m hive_lab.live.simulator_driver`, beside a simulator
without robots and with a real-time factor beyond its reach. It drives more and more robots, each
time first without hearing their scans, then with. It prints the figures as JSON.
"""

from __future__ import annotations

import itertools
import json
import time
import xmlrpc.client
from typing import Any

import numpy as np
import rosgraph
import rospy
from geometry_msgs.msg import Pose2D, Twist
from simenv.srv import Spawn
from std_msgs.msg import Bool
from std_srvs.srv import Empty

from hive_common.ros.signals import init_node
from hive_lab.bench.simulator import NUMBERS, spawn_robots
from hive_lab.bench.usage import usage_of

SECONDS = 5.0  # duration of each case [s, wall clock]
SETTLE = 2.0  # how long the robots drive before that [s, wall clock]

COMMAND_PERIOD = 0.2
"""Time between two commands [s, simulated]; a robot stops after 0.5 s without any."""

LOOK_PERIOD = 0.002  # time between two looks at the clock [s, wall clock]
WAIT = 60.0  # time for the simulator to answer [s, wall clock]


class DrivenRobots:
    """Robots that drive all the time in the simulator, and turn away from obstacles."""

    def __init__(self) -> None:
        """Find room for the robots, without adding any."""
        self._places = spawn_robots(max(NUMBERS))
        self._turns = np.linspace(-0.8, 0.8, max(NUMBERS)).tolist()
        self._commands: list[rospy.Publisher] = []
        self._stuck: list[bool] = []
        self._scans: list[rospy.Subscriber] = []

    def grow(self, number: int) -> None:
        """Reset all robots, and add robots up to a number."""
        rospy.ServiceProxy("simenv/reset", Empty)()
        spawn = rospy.ServiceProxy("simenv/spawn", Spawn)
        for index, name in list(enumerate(self._places.names))[len(self._commands) : number]:
            pose = Pose2D(*self._places.poses[name])
            answer = spawn(name, self._places.model(name).name, pose)
            if not answer.success:
                raise SystemExit(answer.message)
            self._commands.append(rospy.Publisher(f"{name}/cmd_vel", Twist, queue_size=1))
            self._stuck.append(False)
            rospy.Subscriber(f"{name}/bumper", Bool, self._bumped, callback_args=index)

    def _bumped(self, message: Bool, index: int) -> None:
        self._stuck[index] = message.data

    def look(self, *, lasers: bool) -> None:
        """Subscribe to the robots' scans, or unsubscribe."""
        for subscriber in self._scans:
            subscriber.unregister()
        names = self._places.names[: len(self._commands)] if lasers else ()
        self._scans = [rospy.Subscriber(f"{name}/scan", rospy.AnyMsg) for name in names]

    def drive(self, seconds: float) -> None:
        """Let all robots drive for a time [s, wall clock], and end if the node is shut down."""
        end, due = time.monotonic() + seconds, 0.0
        while time.monotonic() < end:
            if rospy.is_shutdown():
                raise SystemExit(1)
            now = rospy.get_time()
            if now >= due:
                due = now + COMMAND_PERIOD
                self._command()
            time.sleep(LOOK_PERIOD)

    def _command(self) -> None:
        command = Twist()
        for publisher, stuck, turn in zip(self._commands, self._stuck, self._turns, strict=False):
            command.linear.x, command.angular.z = -0.3 if stuck else 0.5, turn
            publisher.publish(command)


def processor_time() -> float:
    """Return the simulator's processor time [s]."""
    address = rosgraph.Master(rospy.get_name()).lookupNode("/simulator")
    with xmlrpc.client.ServerProxy(address) as node:
        answer: Any = node.getPid(rospy.get_name())
    pid = int(answer[2])
    return usage_of([pid])[pid].cpu


def measure() -> dict[str, float]:
    """Measure every number of robots, without lasers and with them."""
    rospy.wait_for_service("simenv/spawn", WAIT)
    robots = DrivenRobots()
    figures: dict[str, float] = {}
    for number, lasers in itertools.product(NUMBERS, (False, True)):
        if not lasers:
            robots.grow(number)
        robots.look(lasers=lasers)
        robots.drive(SETTLE)
        cpu, begun, start = processor_time(), time.monotonic(), rospy.get_time()
        robots.drive(SECONDS)
        passed = rospy.get_time() - start
        name = f"node_{'lasers' if lasers else 'bare'}_{number}"
        figures[f"speed_{name}"] = passed / (time.monotonic() - begun)
        figures[f"cpu_{name}"] = passed / (processor_time() - cpu)
    return figures


if __name__ == "__main__":
    # rospy reads this once, and roslaunch may not have set it yet.
    rosgraph.Master("/bench_simulator").setParam("/use_sim_time", True)
    init_node("bench_simulator")
    print(json.dumps(measure()))  # noqa: T201  (what this program is for)
