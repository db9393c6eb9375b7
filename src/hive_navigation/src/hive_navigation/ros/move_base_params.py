# SPDX-License-Identifier: BSD-3-Clause
"""The command `move_base_params`: prints parameters for ROS's own `move_base`."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from hive_common.errors import HiveError
from hive_navigation.control.stock_move_base import stock_parameters
from robot_description.models import load_model

if TYPE_CHECKING:
    from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Print parameters of ROS's own move_base (costmap_2d, navfn, dwa_local_planner) for a robot.

    Returns:
        The exit code: 0, or 1 if the model cannot be used; the reason is on standard error.
    """
    parser = argparse.ArgumentParser(
        prog="move_base_params",
        description="Print parameters of ROS's own move_base (costmap_2d, navfn, "
        "dwa_local_planner) for a robot model.",
        epilog="example: rosrun hive_navigation move_base_params mir100 --robot robot5 > "
        "robot5.yaml; rosparam load robot5.yaml /robot5/move_base",
    )
    parser.add_argument("model", help="name of a robot model, or path of its file")
    parser.add_argument("--robot", default="robot1", help="the robot's name")
    given = parser.parse_args(arguments)
    try:
        text = stock_parameters(load_model(given.model), given.robot)
    except HiveError as error:
        sys.stderr.write(f"move_base_params: {error}\n")
        return 1
    sys.stdout.write(text)
    return 0
