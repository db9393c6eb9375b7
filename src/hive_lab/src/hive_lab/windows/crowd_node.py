# SPDX-License-Identifier: BSD-3-Clause
"""Speaks on the hive's topics for a made-up hive: `python3 -m hive_lab.windows.crowd_node -h`."""

from __future__ import annotations

import argparse
import random
import time

import rospy

from blackboard.domain import talker as topics
from blackboard.ros.codec.conversions import WIRES
from hive_lab.windows.crowd import Crowd

SPEAKS = (topics.SYNC, topics.TASK_STATE, topics.ROBOT_STATUS, topics.BACKUP)
PERIOD = 0.2  # [s] between two heartbeats and two task lists, as the real blackboard has it
TURN = 0.02  # [s] between two bunches of changes
REPORTS = 1.0  # [s] between two reports of a robot
SEED = 4


def main() -> None:
    """Speak until the node is shut down."""
    parser = argparse.ArgumentParser(description="speak on the hive's topics for a made-up hive")
    parser.add_argument("tasks", type=int, help="number of tasks")
    parser.add_argument("robots", type=int, help="number of robots")
    parser.add_argument("rate", type=int, help="messages a second, in sum")
    arguments = parser.parse_args(rospy.myargv()[1:])
    rospy.init_node("blackboard")
    publishers: dict[str, rospy.Publisher] = {
        topic: rospy.Publisher(
            topic, WIRES[topic].message, latch=WIRES[topic].latched, queue_size=1000
        )
        for topic in SPEAKS
    }
    generator = random.Random(SEED)
    crowd = Crowd(arguments.tasks, arguments.robots, rospy.get_time(), generator)

    def say(topic: str, value: object) -> None:
        publishers[topic].publish(WIRES[topic].to_msg(value))

    changes = max(0.0, arguments.rate - arguments.robots / REPORTS - 2 / PERIOD)
    begin = time.monotonic()
    said = {"changes": 0, "reports": 0, "beats": 0}
    while not rospy.is_shutdown():
        passed = time.monotonic() - begin
        while said["beats"] < passed / PERIOD:
            say(topics.BACKUP, crowd.beat())
            if changes or not said["beats"]:
                say(topics.SYNC, crowd.list())
            said["beats"] += 1
        while said["reports"] < passed / REPORTS * arguments.robots:
            say(topics.ROBOT_STATUS, crowd.report(said["reports"] % arguments.robots))
            said["reports"] += 1
        while said["changes"] < passed * changes:
            say(topics.TASK_STATE, crowd.change())
            said["changes"] += 1
        time.sleep(TURN)


if __name__ == "__main__":
    main()
