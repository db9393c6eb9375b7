# SPDX-License-Identifier: BSD-3-Clause
"""A node that publishes a fake fleet: `python3 -m hive_lab.windows.fake_fleet_node -h`."""

from __future__ import annotations

import argparse
import random
import time

import rospy

from blackboard.codec.tables import WIRES
from blackboard.domain import talker as topics
from hive_common.ros.signals import init_node
from hive_lab.windows.fake_fleet import FakeFleet

SPEAKS = (topics.SYNC, topics.TASK_STATE, topics.ROBOT_STATUS, topics.BACKUP)
PERIOD = 0.2  # [s] between two heartbeats and two task lists, as the real blackboard has it
TURN = 0.02  # [s] between two batches of changes
REPORTS = 1.0  # [s] between two reports of a robot
SEED = 4


def main() -> None:
    """Publish until the node is shut down."""
    parser = argparse.ArgumentParser(description="publish a fake fleet on the hive's topics")
    parser.add_argument("tasks", type=int, help="number of tasks")
    parser.add_argument("robots", type=int, help="number of robots")
    parser.add_argument("rate", type=int, help="messages a second, in total")
    arguments = parser.parse_args(rospy.myargv()[1:])
    init_node("blackboard")
    publishers: dict[str, rospy.Publisher] = {
        topic: rospy.Publisher(
            topic, WIRES[topic].message, latch=WIRES[topic].latched, queue_size=1000
        )
        for topic in SPEAKS
    }
    generator = random.Random(SEED)
    fleet = FakeFleet(arguments.tasks, arguments.robots, rospy.get_time(), generator)

    def say(topic: str, value: object) -> None:
        publishers[topic].publish(WIRES[topic].to_msg(value, rospy.get_time()))

    changes = max(0.0, arguments.rate - arguments.robots / REPORTS - 2 / PERIOD)
    begin = time.monotonic()
    said = {"changes": 0, "reports": 0, "beats": 0}
    while not rospy.is_shutdown():
        passed = time.monotonic() - begin
        while said["beats"] < passed / PERIOD:
            say(topics.BACKUP, fleet.beat())
            if changes or not said["beats"]:
                say(topics.SYNC, fleet.list())
            said["beats"] += 1
        while said["reports"] < passed / REPORTS * arguments.robots:
            say(topics.ROBOT_STATUS, fleet.report(said["reports"] % arguments.robots))
            said["reports"] += 1
        while said["changes"] < passed * changes:
            say(topics.TASK_STATE, fleet.change())
            said["changes"] += 1
        time.sleep(TURN)


if __name__ == "__main__":
    main()
