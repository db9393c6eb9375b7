# SPDX-License-Identifier: BSD-3-Clause
"""The command `rosrun hive_navigation map_saver`: saves a published map, as ROS's own does.

ROS Subscribers:
    map (nav_msgs/OccupancyGrid)
"""

from __future__ import annotations

import argparse
from pathlib import Path

import rospy
from nav_msgs.msg import OccupancyGrid
from rospy.numpy_msg import numpy_msg

from hive_common.errors import HiveError, MapError
from hive_common.grid_map import FREE, OCCUPIED, UNKNOWN
from hive_common.map_file import FORMATS, save_map
from hive_common.ros.conversions import map_from_msg
from hive_common.ros.reconnecting import keep_connected
from hive_common.ros.signals import init_node


def main() -> int:
    """Save the map; return the exit code."""
    given = _parser().parse_args(rospy.myargv()[1:])
    init_node("map_saver", anonymous=True)
    keep_connected()
    try:
        summary = _save(given)
    except rospy.ROSInterruptException:
        return 1
    except HiveError as error:
        rospy.logfatal(str(error))
        return 1
    rospy.loginfo(summary)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="map_saver",
        description="Save the map on the topic map as NAME.yaml and NAME.pgm.",
        epilog="example: rosrun hive_navigation map_saver -f maps/my_hall map:=/map",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    add = parser.add_argument
    add("-f", dest="name", type=Path, default=Path("map"), help="file name without suffix")
    add("--free", type=_share, default=25, help="cells up to this value are free, 0..100")
    add("--occ", type=_share, default=65, help="cells from this value on are occupied, 0..100")
    add("--format", choices=FORMATS, default="pgm", help="image format")
    add("--timeout", type=float, default=30.0, help="time to wait for a map [s]")
    return parser


def _share(word: str) -> int:
    value = int(word)
    if not FREE <= value <= OCCUPIED:
        raise argparse.ArgumentTypeError(f"{value}; allowed: {FREE} to {OCCUPIED}")
    return value


def _save(given: argparse.Namespace) -> str:
    """Write the files and return a summary; raise MapError if there is no map or it fails."""
    if given.free >= given.occ:
        raise MapError(f"--free {given.free} is not below --occ {given.occ}; try 25 and 65")
    try:
        message = rospy.wait_for_message("map", numpy_msg(OccupancyGrid), timeout=given.timeout)
    except rospy.ROSInterruptException:
        raise
    except rospy.ROSException:
        raise MapError(
            f"no map on {rospy.resolve_name('map')} within {given.timeout:g} s; start a mapper, "
            "or name the topic with map:=..."
        ) from None
    grid = map_from_msg(message).decided(given.free, given.occ)
    save_map(grid, given.name, kind=given.format)
    height, width = grid.cells.shape
    known = int((grid.cells != UNKNOWN).sum())
    return (
        f"{given.name}.yaml, {given.name}.{given.format}: {width} x {height} cells of "
        f"{grid.resolution:g} m, {known / grid.cells.size:.0%} known"
    )
