# SPDX-License-Identifier: BSD-3-Clause
"""Keeps why a node did not start where windows and commands find it.

The log of a launch scrolls away, and a window that is opened later never had it. So a node that
refuses to start leaves its reason with the ROS master, and takes it away when it starts again.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

import rospy

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

PARAMETER = "/refused_to_start"
"""For each node, by its full name, a `reason`. A robot's name may be the begin of a node's."""

_REASON = "reason"


def refuse_to_start(reason: str, node: str = "") -> None:
    """Log why a node does not start, and keep it with the ROS master.

    Args:
        reason: A sentence that names the value, what is allowed, and what to do.
        node: The full name of the node; by default that of this process.
    """
    rospy.logfatal(reason)
    with contextlib.suppress(rospy.ROSException, OSError):
        rospy.set_param(_parameter(node), reason)


def forget_refusal(node: str = "") -> None:
    """Take back what an earlier start of a node has left; see `refuse_to_start`."""
    name = _parameter(node)
    with contextlib.suppress(rospy.ROSException, OSError, KeyError):
        if rospy.has_param(name):
            rospy.delete_param(name)


def refusals() -> dict[str, str]:
    """Return why nodes refused to start, by their names without the leading slash."""
    with contextlib.suppress(rospy.ROSException, OSError):
        return dict(_flat(rospy.get_param(PARAMETER, {})))
    return {}


def _parameter(node: str) -> str:
    return f"{PARAMETER}{node or rospy.get_name()}/{_REASON}"


def _flat(found: object, name: str = "") -> Iterator[tuple[str, str]]:
    """Return the reasons in a tree of parameters with the nodes' names; all else is none."""
    if not isinstance(found, dict):
        return
    tree: Mapping[str, object] = found
    for key, below in sorted(tree.items()):
        if key == _REASON and isinstance(below, str) and name:
            yield name.lstrip("/"), below
        else:
            yield from _flat(below, f"{name}/{key}")
