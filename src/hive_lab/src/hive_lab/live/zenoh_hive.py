# SPDX-License-Identifier: BSD-3-Clause
"""A hive of several processes on this machine that speak over Zenoh, each with its certificate."""

from __future__ import annotations

import contextlib
import socket
import time
from typing import TYPE_CHECKING

import rospy

from blackboard.errors import LiveHiveError
from blackboard.zenoh.access import Role
from blackboard.zenoh.settings import ZenohSettings
from fleet_manager.certs.site import Site
from fleet_manager.config.zenoh_launch import connection_of
from hive_common.structuring import structure
from hive_lab.live.live_hive import LiveHive
from hive_lab.live.site_file import router_command, write_fleet

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

OPERATOR = "operator"
"""Whose certificate a program has that posts."""

ROUTER = "router"
"""The name of the router, if there is one."""

_ROUTER_WITHIN = 60.0
_LOOK_EVERY = 0.05
"""Times of the wall clock [s]."""

_PORTS = range(61_000, 65_536)
"""Linux gives none of these to connections."""


class ZenohHive(LiveHive):
    """The processes of one hive. Its members share a ROS master for parameters and their bases.

    Args:
        folder: For certificates, journals and logs.
        namespace: Of the hive, beginning and ending in a slash.
        robots: Names of its robots.
        has_router: Whether they connect to a router, instead of to each other.

    Attributes:
        site: The hive's authority.
    """

    def __init__(
        self, folder: Path, namespace: str, robots: Sequence[str], *, has_router: bool = False
    ) -> None:
        folder.mkdir(parents=True)
        self.site = Site.new(folder / "site")
        self.site.add("blackboard", Role.BLACKBOARD)
        for robot in robots:
            self.site.add(robot, Role.ROBOT)
        self.site.add(OPERATOR, Role.OPERATOR)
        names = (ROUTER,) if has_router else ("blackboard", *robots)
        if has_router:
            self.site.add(ROUTER, Role.ROUTER)
        reached = [
            {"name": name, "address": f"127.0.0.1:{port}"}
            for name, port in zip(names, free_ports(len(names)), strict=True)
        ]
        zenoh = {
            "certificates": str(self.site.folder / "members"),
            "routers" if has_router else "members": reached,
        }
        self._fleet = write_fleet(folder / "fleet.yaml", robots, zenoh)
        super().__init__(folder, namespace, robots)

    def set_parameters(self) -> None:
        """Set the parameters of all nodes on the ROS master."""
        super().set_parameters()
        for name in ("blackboard", *self.robots):
            own = connection_of(self._fleet, name) | {"own_master": False}
            rospy.set_param(f"{self.namespace}{name}/zenoh", own)

    @property
    def fleet_file(self) -> Path:
        """Return the file of this fleet."""
        return self._fleet.path

    def operator_settings(self) -> ZenohSettings:
        """Return how a program that posts takes part."""
        return structure(connection_of(self._fleet, OPERATOR), ZenohSettings)

    def start_router(self) -> None:
        """Start the router and wait until it listens; without one do nothing.

        Raises:
            LiveHiveError: It does not listen in time.
        """
        if not self._fleet.zenoh.routers:
            return
        self.start(ROUTER, program=router_command(self._fleet, ROUTER))
        end = time.monotonic() + _ROUTER_WITHIN
        while "listens at" not in self.log_of(ROUTER):
            if time.monotonic() > end:
                raise LiveHiveError(f"the router says: {self.log_of(ROUTER)}")
            time.sleep(_LOOK_EVERY)


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
