# SPDX-License-Identifier: BSD-3-Clause
"""A hive of several processes on this machine that speak over Zenoh, each with its certificate."""

from __future__ import annotations

import contextlib
import socket
from typing import TYPE_CHECKING

import rospy

from blackboard.errors import LiveHiveError
from blackboard.zenoh.access import Role
from fleet_manager.certs.site import Site
from hive_lab.live.live_hive import LiveHive

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

OPERATOR = "operator"
"""Whose certificate a program has that posts."""

_PORTS = range(61_000, 65_536)
"""Linux gives none of these to connections."""


class ZenohHive(LiveHive):
    """The processes of one hive. Its members share a ROS master for parameters and their bases.

    Args:
        folder: For certificates, journals and logs.
        namespace: Of the hive, beginning and ending in a slash.
        robots: Names of its robots.

    Attributes:
        site: The hive's authority.
        endpoints: Where its members are reached, the blackboard first.
    """

    def __init__(self, folder: Path, namespace: str, robots: Sequence[str]) -> None:
        folder.mkdir(parents=True)
        self.site = Site.new(folder / "site")
        self.site.add("blackboard", Role.BLACKBOARD)
        for robot in robots:
            self.site.add(robot, Role.ROBOT)
        self.site.add(OPERATOR, Role.OPERATOR)
        self.endpoints = tuple(f"tls/127.0.0.1:{port}" for port in free_ports(1 + len(robots)))
        super().__init__(folder, namespace, robots)

    def set_parameters(self) -> None:
        """Set the parameters of all nodes on the ROS master."""
        super().set_parameters()
        for place, name in enumerate(("blackboard", *self.robots)):
            own = {
                "listen": [self.endpoints[place]],
                "connect": list(self.endpoints[:place]),
                "certificates": str(self.site.folder_of(name)),
                "own_master": False,
            }
            rospy.set_param(f"{self.namespace}{name}/zenoh", own)


def free_ports(count: int) -> list[int]:
    """Return ports of this machine's loopback that nobody uses, and that are given to nobody else.

    Raises:
        LiveHiveError: There are not so many.
    """
    found: list[int] = []
    for port in _PORTS:
        with contextlib.suppress(OSError), socket.socket() as probe:
            probe.bind(("127.0.0.1", port))
            found.append(port)
        if len(found) == count:
            return found
    raise LiveHiveError(f"{len(found)} ports are free; {count} are needed")
