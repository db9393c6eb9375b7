# SPDX-License-Identifier: BSD-3-Clause
"""The map server, with the arguments, topics and services of ROS's own.

    rosrun hive_navigation map_server FILE.yaml

ROS Publishers:
    map (nav_msgs/OccupancyGrid), map_metadata (nav_msgs/MapMetaData): latched. The cells are
        those of the file, and a yaw of its origin is that of the message.
    map_in_use (robot_description/MapInUse): the map's name and checksum, latched.
ROS Services:
    static_map (nav_msgs/GetMap); change_map (nav_msgs/LoadMap), which reads another file, that
        all nodes of the hive then use.
ROS Parameters:
    ~map (lab): name of a map of this workspace, or the path of a YAML file; an argument goes
        before it. `change_map` sets it.
    ~frame_id (map): the map's frame.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, GetMapResponse, LoadMap, LoadMapResponse
from robot_description.msg import MapInUse
from std_msgs.msg import Header

from hive_common.errors import FileError, MapError, ParameterError
from hive_common.map_file import load_turned_map
from hive_common.map_id import checksum_of
from hive_common.ros.conversions import map_msg
from hive_common.ros.params import text
from hive_navigation.ros.startup import run_node

if TYPE_CHECKING:
    from nav_msgs.srv import GetMapRequest, LoadMapRequest


class MapServer:
    """Serves one map at a time.

    Raises:
        FileError: The map's YAML file cannot be read or used.
        MapError: Its image cannot be used.
    """

    def __init__(self, name: str, frame: str) -> None:
        """Read the map of a name or path, and serve it in a frame."""
        self._frame = frame
        self._map, self._in_use = self._read(name)
        self._publishers = [
            rospy.Publisher(topic, kind, queue_size=1, latch=True)
            for topic, kind in (
                ("map_in_use", MapInUse),  # whoever hears of a map can then name it
                ("map", OccupancyGrid),
                ("map_metadata", MapMetaData),
            )
        ]
        self._publish()
        rospy.Service("static_map", GetMap, self._serve)
        rospy.Service("change_map", LoadMap, self._change)

    def _read(self, name: str) -> tuple[OccupancyGrid, MapInUse]:
        grid = load_turned_map(name, rospy.logwarn)
        height, width = grid.cells.shape
        rospy.loginfo(f"map '{name}': {width} x {height} cells of {grid.resolution:g} m")
        message = map_msg(Header(stamp=rospy.Time.now(), frame_id=self._frame), grid)
        return message, MapInUse("map_server", Path(name).stem, checksum_of(grid.upright()))

    def _publish(self) -> None:
        contents = (self._in_use, self._map, self._map.info)
        for publisher, content in zip(self._publishers, contents, strict=True):
            publisher.publish(content)

    def _serve(self, _request: GetMapRequest) -> GetMapResponse:
        return GetMapResponse(self._map)

    def _change(self, request: LoadMapRequest) -> LoadMapResponse:
        """Serve another map from now on; one that cannot be used changes nothing."""
        try:
            self._map, self._in_use = self._read(request.map_url)
        except (FileError, MapError) as error:
            rospy.logerr(f"change_map: {error}")
            image = isinstance(error, MapError)
            invalid_file = LoadMapResponse.RESULT_INVALID_MAP_METADATA
            invalid = LoadMapResponse.RESULT_INVALID_MAP_DATA if image else invalid_file
            return LoadMapResponse(result=invalid)
        self._publish()
        # One that is started again serves what this one served.
        rospy.set_param("~map", request.map_url)
        return LoadMapResponse(self._map, LoadMapResponse.RESULT_SUCCESS)


def main() -> int:
    """Run the node; return its exit code."""
    return run_node("map_server", _run)


def _run() -> None:
    arguments = rospy.myargv()[1:]
    if len(arguments) > 1:
        raise ParameterError(
            f"map_server: {' '.join(arguments)}; allowed: one argument, the map's .yaml file"
        )
    name = arguments[0] if arguments else text("map", default="lab")
    # What the master and rospy hold of it lives as long as the process.
    MapServer(name, text("frame_id", default="map"))
    rospy.spin()
