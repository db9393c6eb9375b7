# SPDX-License-Identifier: BSD-3-Clause
"""The map server, with the topics and the service of ROS's own.

ROS Publishers:
    map (nav_msgs/OccupancyGrid), map_metadata (nav_msgs/MapMetaData): latched.
ROS Services:
    static_map (nav_msgs/GetMap)
ROS Parameters:
    ~map (lab): name of a map of this workspace, or the path of a YAML file.
    ~frame_id (map): the map's frame.
"""

from __future__ import annotations

import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, GetMapResponse
from std_msgs.msg import Header

from hive_common.map_file import load_map
from hive_common.ros.conversions import map_msg
from hive_common.ros.params import text
from robot_navigation.ros.startup import run_node


def main() -> int:
    """Run the node; return its exit code."""
    return run_node("map_server", _run)


def _run() -> None:
    name = text("map", default="lab")
    frame = text("frame_id", default="map")
    grid = load_map(name)
    message = map_msg(Header(stamp=rospy.Time.now(), frame_id=frame), grid)
    publishers = [
        rospy.Publisher(topic, kind, queue_size=1, latch=True)
        for topic, kind in (("map", OccupancyGrid), ("map_metadata", MapMetaData))
    ]
    for publisher, content in zip(publishers, (message, message.info), strict=True):
        publisher.publish(content)
    rospy.Service("static_map", GetMap, lambda _: GetMapResponse(message))
    height, width = grid.cells.shape
    rospy.loginfo(f"map '{name}': {width} x {height} cells of {grid.resolution:g} m")
    rospy.spin()
