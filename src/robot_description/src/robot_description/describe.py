# SPDX-License-Identifier: BSD-3-Clause
"""The command `describe_robot`: prints what launch files put on the parameter server."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from hive_common.errors import HiveError
from robot_description.models import load_model, model_path
from robot_description.urdf import robot_urdf

if TYPE_CHECKING:
    from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a robot's URDF, or its model file after checking it.

    Returns:
        The exit code: 0, or 1 if the model cannot be used; the reason is on standard error.
    """
    parser = argparse.ArgumentParser(prog="describe_robot", description=main.__doc__)
    parser.add_argument("what", choices=["urdf", "characteristics"])
    parser.add_argument("--model", required=True, help="name of a model, or path of its file")
    parser.add_argument("--prefix", default="", help="in front of frame names, such as robot1/")
    wanted = parser.parse_args(arguments)
    try:
        sys.stdout.write(_text(wanted.what, wanted.model, wanted.prefix))
    except HiveError as error:
        sys.stderr.write(f"describe_robot: {error}\n")
        return 1
    return 0


def _text(what: str, model: str, prefix: str) -> str:
    if what == "characteristics":
        load_model(model)
        return model_path(model).read_text(encoding="utf-8")
    return robot_urdf(model, prefix)
