# SPDX-License-Identifier: BSD-3-Clause
"""What a node of this package does before its work: it reads parameters and robot model."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, TypeVar

import rospy

from hive_common.errors import HiveError, ParameterError
from hive_common.ros.links import mend_links
from hive_common.ros.params import below, structured
from hive_common.ros.refusal import forget_refusal, refuse_to_start
from hive_common.ros.sending import send_promptly
from hive_common.ros.signals import init_node
from robot_description.models import RobotModel

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from hive_common.ros.names import RobotNames

Settings = TypeVar("Settings")


def run_node(name: str, run: Callable[[], None]) -> int:
    """Run a node until it is shut down; return its exit code."""
    init_node(name)
    send_promptly()
    mend_links()
    forget_refusal()
    try:
        run()
    except HiveError as error:
        refuse_to_start(str(error))
        return 1
    except rospy.ROSInterruptException:
        pass
    return 0


def read_model(names: RobotNames) -> RobotModel:
    """Read a robot's model from its parameter `characteristics`.

    Raises:
        ParameterError: The parameter is missing, or holds something that is not allowed.
    """
    try:
        return structured(names.of("characteristics"), RobotModel, {})
    except ParameterError as error:
        raise ParameterError(
            f"{error}; load a robot model with roslaunch robot_description description.launch"
        ) from None


def read_settings(
    kind: type[Settings],
    node: str = "",
    without_effect: Collection[str] = (),
    **defaults: object,
) -> Settings:
    """Read the private parameters of a node.

    Args:
        kind: The dataclass of settings that has a field for each parameter.
        node: The node's full name; by default this process's.
        without_effect: Other parameters that may be there; a warning names them.
        defaults: Values that replace defaults of `kind`.

    Raises:
        ParameterError: A parameter is unknown or has a value that is not allowed.
    """
    types: dict[str, type] = {field.name: type(field.default) for field in fields(kind)}  # type: ignore[arg-type]  # a dataclass
    for name, value in below(node or rospy.get_name()).items():
        if name in without_effect:
            rospy.logwarn(f"parameter ~{name} of ROS's own node has no effect here")
            continue
        if name not in types:
            allowed = ", ".join(sorted(types))
            raise ParameterError(f"parameter ~{name} is unknown; allowed: {allowed}")
        try:
            defaults[name] = types[name](value)
            good = not isinstance(value, bool)
        except (OverflowError, TypeError, ValueError):
            good = False
        if not good:
            allowed = {int: "a whole number", float: "a number"}.get(types[name], "a text")
            raise ParameterError(f"parameter ~{name}: {value!r}; allowed: {allowed}")
    return kind(**defaults)
