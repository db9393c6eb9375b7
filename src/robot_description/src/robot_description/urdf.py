# SPDX-License-Identifier: BSD-3-Clause
"""Makes a robot's URDF from its model file and the one xacro file for all robots.

It checks the model file first, so that a mistake is reported by line and key instead of as an
error inside xacro. It uses xacro as a library, without ROS.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hive_common.resources import package_folder
from robot_description.models import load_model, model_path

if TYPE_CHECKING:
    from pathlib import Path


def robot_urdf(model: str | Path, prefix: str = "") -> str:
    """Return the URDF of a robot, with the root link `<prefix>base_footprint`.

    Args:
        model: The name of a model of this package, or the path of a model file.
        prefix: Of every link's name, such as `robot1/`.

    Raises:
        FileError: The model is unknown, or its file holds something that is not allowed.
    """
    import xacro  # noqa: PLC0415  (it takes longer to import than to run, and few need it)

    load_model(model)
    template = package_folder("robot_description") / "urdf" / "robot.urdf.xacro"
    # Absolute, because xacro looks for a relative path in the folder of the template.
    arguments = {"model_file": str(model_path(model).absolute()), "prefix": prefix}
    document = xacro.process_file(str(template), mappings=arguments)
    return str(document.toprettyxml(indent="  "))
