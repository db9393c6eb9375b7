# SPDX-License-Identifier: BSD-3-Clause
"""The command `rosrun simenv map_saver`: writes the map that is published, as ROS's own does.

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
from hive_common.map_file import FORMATS, FREE, OCCUPIED, UNKNOWN, save_map
from hive_common.ros.conversions import map_from_msg


def main() -> int:
    """Write the map; return the exit code."""
    given = _parser().parse_args(rospy.myargv()[1:])
    rospy.init_node("map_saver", anonymous=True)
    try:
        told = _save(given)
    except rospy.ROSInterruptException:
        return 1
    except HiveError as error:
        rospy.logfatal(str(error))
        return 1
    rospy.loginfo(told)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="map_saver",
        description="Write the map that is on the topic map, as NAME.yaml and NAME.pgm.",
        epilog="example: rosrun simenv map_saver -f maps/my_hall map:=/map",
    )
    parser.add_argument(
        "-f", dest="name", type=Path, default=Path("map"), help="path without suffix (%(default)s)"
    )
    parser.add_argument(
        "--free", type=_share, default=25, help="cells up to this are free, 0..100 (%(default)s)"
    )
    parser.add_argument(
        "--occ", type=_share, default=65, help="cells from this on are occupied (%(default)s)"
    )
    parser.add_argument("--format", choices=FORMATS, default="pgm", help="of the image")
    parser.add_argument(
        "--timeout", type=float, default=30.0, help="how long to wait for a map [s] (%(default)s)"
    )
    return parser


def _share(word: str) -> int:
    value = int(word)
    if not FREE <= value <= OCCUPIED:
        raise argparse.ArgumentTypeError(f"{value}; allowed: {FREE} to {OCCUPIED}")
    return value


def _save(given: argparse.Namespace) -> str:
    """Write the files; return what to say.

    Raises:
        MapError: There is no map, or it cannot be written.
    """
    if given.free >= given.occ:
        raise MapError(f"--free {given.free} is not below --occ {given.occ}; usual are 25 and 65")
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
