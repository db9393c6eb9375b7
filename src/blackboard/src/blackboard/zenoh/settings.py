# SPDX-License-Identifier: BSD-3-Clause
"""The parameter `zenoh`: how a process takes part in a hive over Zenoh."""

import ipaddress
import re
from pathlib import Path
from typing import Annotated, Any

import attrs

from blackboard.errors import SettingsError
from blackboard.zenoh.session import Endpoints, Mode, Own, read_own, session_config
from hive_common.structuring import Allowed, one_of

_HIVE = "hive"
"""The hive's name where there are no certificates, which name their site."""


@attrs.frozen(kw_only=True)
class ZenohSettings:
    """Where a process is reached, what it connects to, and who it is."""

    listen: tuple[str, ...] = ()
    """Endpoints at which others reach it, such as `tls/192.168.1.12:7447`."""
    connect: tuple[str, ...] = ()
    """Endpoints that it connects to."""
    certificates: str = ""
    """The folder that `hive certs` has made for it; without one it stays on this machine."""
    hive: Annotated[
        str,
        Allowed(
            "a name of letters, digits, '_' and '-'", re.compile(r"[A-Za-z0-9_-]{1,64}").fullmatch
        ),
    ] = _HIVE
    """The hive's name in keys, without certificates; with them it is their site."""
    mode: Annotated[str, one_of(Mode.PEER.value, Mode.CLIENT.value)] = Mode.PEER.value
    """Whether it connects to all others, or to one router, the first of `connect` that answers."""
    own_master: bool = True
    """Whether its machine has a ROS master of its own. If so, this process also carries what
    robots and the traffic planner announce to each other, and where robots are and drive; if not,
    all hear that over the one ROS master."""

    @property
    def endpoints(self) -> Endpoints:
        """Where it is reached, and what it connects to."""
        return Endpoints(self.listen, self.connect)

    @property
    def folder(self) -> Path | None:
        """The folder of its certificate; None if it has none."""
        return Path(self.certificates).expanduser() if self.certificates else None

    def session(self) -> dict[str, Any]:
        """Return the configuration of its session; see `session.session_config`."""
        return session_config(self.endpoints, self.folder, Mode(self.mode))

    @property
    def address(self) -> str:
        """Where others reach it, as HOST:PORT; empty where it does not say at one address."""
        for each in self.listen:
            address = each.partition("/")[2]
            host, _, port = address.rpartition(":")
            if _is_one(host.strip("[]")) and port.isdecimal() and int(port):
                return address
        return ""

    def own(self, name: str) -> Own:
        """Return the hive, and as whom this process speaks there.

        Args:
            name: Who it has to be, for example its robot; empty if anyone.

        Raises:
            SettingsError: Its certificate is another one's, or cannot be used.
        """
        if self.folder is None:
            return Own(self.hive, name or "operator")
        own = read_own(self.folder)
        if name not in {"", own.name}:
            raise SettingsError(
                f"zenoh/certificates: {self.folder} is the folder of {own.name}; allowed: that of "
                f"{name}, which `hive certs add {name}` makes"
            )
        return own


def _is_one(host: str) -> bool:
    """Return whether a host is one address; `0.0.0.0` stands for all of a machine."""
    try:
        return not ipaddress.ip_address(host).is_unspecified
    except ValueError:
        return False
