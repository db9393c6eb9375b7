# SPDX-License-Identifier: BSD-3-Clause
"""Reads a node's private parameters, once, into the core's settings."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import rospy
from attrs import fields

from blackboard.errors import SettingsError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from blackboard.domain.settings import Settings

S = TypeVar("S", bound="Settings")


def read(kind: type[S], node: str = "~") -> S:
    """Read the private parameters that a kind of settings has, with its defaults.

    Args:
        kind: Of settings.
        node: Whose parameters; by default this node's.

    Raises:
        SettingsError: A value has the wrong type or is not allowed; the text names it.
    """
    values = {}
    for each in fields(kind):
        name = rospy.resolve_name(f"~{each.name}" if node == "~" else f"{node}/{each.name}")
        value = rospy.get_param(name, each.default)
        wanted = type(each.default)
        if wanted is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if not isinstance(value, wanted) or isinstance(value, bool):
            raise SettingsError(f"{name} is {value!r}; allowed: a {wanted.__name__}")
        values[each.name] = value
    try:
        return kind(**values)
    except SettingsError as error:
        raise SettingsError(f"{rospy.get_name()}/{error}") from None


def read_flag(name: str, *, default: bool) -> bool:
    """Read a private parameter that is true or false.

    Args:
        name: Of the parameter.
        default: Where it is not set.

    Raises:
        SettingsError: It is neither; the text names it.
    """
    value = rospy.get_param(f"~{name}", default)
    if not isinstance(value, bool):
        full_name = rospy.resolve_name(f"~{name}")
        raise SettingsError(f"{full_name} is {value!r}; allowed: true or false")
    return value


def refuse_unknown(kinds: Sequence[type[Settings]], others: Sequence[str] = ()) -> None:
    """Check that no private parameter is set that nothing reads: most likely a slip of the pen.

    Args:
        kinds: The settings that the node reads.
        others: Names of further private parameters that it reads.

    Raises:
        SettingsError: There is one; the text names it and those there are.
    """
    known = sorted({each.name for kind in kinds for each in fields(kind)} | set(others))
    for name in rospy.get_param(rospy.get_name(), {}):
        if name not in known:
            raise SettingsError(
                f"{rospy.get_name()}/{name} is unknown; allowed: {', '.join(known)}"
            )
