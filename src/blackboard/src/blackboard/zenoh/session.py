# SPDX-License-Identifier: BSD-3-Clause
"""How a member's Zenoh session is configured, with its certificate or on loopback only."""

from __future__ import annotations

import ipaddress
import json
import re
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any

from blackboard.errors import SettingsError
from blackboard.zenoh.access import PART

if TYPE_CHECKING:
    from pathlib import Path

AUTHORITY, CERTIFICATE, KEY, ACCESS = "authority.crt", "own.crt", "own.key", "access.json"
OWN = "own.json"
"""The files of an identity, in a folder of its own."""

ACCESS_FORMAT = 2
"""Changes with what the keys of messages mean: with a list of another version, a member would not
be heard, and nobody would know why."""

_RETRY = {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 2.0}
"""When a connection is tried again; a session is back 0.3 s after what it connects to."""


_HANDSHAKE = 3000
"""How long another process may take to answer while a connection to it is opened [ms]. A client
asks no other router meanwhile, and a session that is closed waits as long, so a process would take
long to end while another one hangs."""


_ADDRESS = re.compile(r"([A-Za-z0-9._-]+|\[[0-9A-Fa-f:.]+(%[A-Za-z0-9]+)?\]):[0-9]{1,5}")

_HIGHEST_PORT = 65_535

_PRIORITIES = ("control", "interactive_high", "data")
"""What a session says has one of these priorities, in Zenoh's words."""

_BATCHES = 16
"""How many batches of each priority may wait for a connection, as many as Zenoh allows. With its
two, a hive lost messages that it said at once (docs/benchmarks.md, auction)."""


class Mode(Enum):
    """How a session takes part, in Zenoh's words."""

    PEER = "peer"  # connects to all others, directly
    CLIENT = "client"  # connects to one router, and to another one when that is gone
    ROUTER = "router"  # passes on what others say


_PATIENCE = {Mode.PEER: 500, Mode.ROUTER: 500, Mode.CLIENT: 0}
"""How long opening a session waits for what it connects to [ms]; the session goes on trying. With
0, a client asks each of its routers once, in their order, and opens only if one answers; with more
it would ask the first one alone until that answers."""

_LEASE = {Mode.PEER: 10_000, Mode.CLIENT: 10_000, Mode.ROUTER: 2_000}
"""How long others keep a connection to this session on which it says nothing [ms]. While a router
hangs, all its clients are deaf; peers have the hive's own time-outs."""


@dataclass(frozen=True)
class Endpoints:
    """Where a session is reached, and what it connects to, as Zenoh writes them.

    For example `tls/192.168.1.12:7447`.
    """

    listen: tuple[str, ...] = ()
    connect: tuple[str, ...] = ()


def session_config(
    endpoints: Endpoints, folder: Path | None = None, mode: Mode = Mode.PEER
) -> dict[str, Any]:
    """Return the configuration of a session; `zenoh.Config.from_json5` takes it as JSON.

    Args:
        endpoints: Where it is reached, and what it connects to.
        folder: The files of its identity; without them it stays on this machine.
        mode: How it takes part.

    Raises:
        SettingsError: An endpoint is not allowed: without certificates it has to be `tcp/` at an
            address of this machine's loopback, with them `tls/`. Or a file is missing or unusable.
    """
    check = _check_bare if folder is None else _check_encrypted
    for each in (*endpoints.listen, *endpoints.connect):
        check(each)
    config: dict[str, Any] = {
        "mode": mode.value,
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "listen": {"endpoints": list(endpoints.listen)},
        "transport": {
            "unicast": {"open_timeout": _HANDSHAKE, "accept_timeout": _HANDSHAKE},
            "link": {
                "tx": {
                    "lease": _LEASE[mode],
                    "queue": {"size": dict.fromkeys(_PRIORITIES, _BATCHES)},
                }
            },
            # Between processes of one machine: with fifty of them it took 900 MB of each leader.
            "shared_memory": {"enabled": False},
        },
        "connect": {
            "endpoints": list(endpoints.connect),
            "timeout_ms": _PATIENCE[mode],
            "exit_on_failure": False,
            "retry": _RETRY,
        },
    }
    if folder is not None:
        config["transport"]["link"]["tls"] = _encryption(folder)
        config["access_control"] = _access(folder / ACCESS)
    return config


@dataclass(frozen=True)
class Own:
    """Who a process is.

    Attributes:
        hive: The hive's name in keys.
        name: The last part of the keys on which it speaks.
    """

    hive: str
    name: str


def read_own(folder: Path) -> Own:
    """Return whose certificate is in a folder; what others believe is the certificate alone.

    Raises:
        SettingsError: It does not say.
    """
    try:
        content = json.loads((folder / OWN).read_text(encoding="utf-8"))
        return Own(*(_part(content[key]) for key in ("hive", "name")))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SettingsError(
            f"{folder / OWN} cannot be used ({error}); copy the whole folder that `hive certs "
            "add` has made"
        ) from None


def _part(value: str) -> str:
    """Return a part of a key; raise ValueError or TypeError if it cannot be one."""
    if not PART.fullmatch(value):
        raise ValueError(f"{value!r:.80} is no name")
    return value


def _encryption(folder: Path) -> dict[str, Any]:
    """Return how connections prove who they are, in both directions.

    Names of hosts are not compared: what counts is which identity a certificate is for, and the
    access control decides by that.
    """
    for name in (AUTHORITY, CERTIFICATE, KEY):
        if not (folder / name).is_file():
            raise SettingsError(
                f"{folder} has no {name}; copy the whole folder that `hive certs add` has made"
            )
    own, key = str(folder / CERTIFICATE), str(folder / KEY)
    return {
        "root_ca_certificate": str(folder / AUTHORITY),
        "listen_certificate": own,
        "listen_private_key": key,
        "connect_certificate": own,
        "connect_private_key": key,
        "enable_mtls": True,
        "verify_name_on_connect": False,
        "close_link_on_expiration": True,
    }


def _access(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise SettingsError(
            f"{path} cannot be used ({error}); copy the one that `hive certs` has written"
        ) from None
    written = content.get("format") if isinstance(content, dict) else None
    section = content.get("access_control") if written == ACCESS_FORMAT else None
    guards = {"enabled": True, "default_permission": "deny"}
    if not isinstance(section, dict) or not guards.items() <= section.items():
        raise SettingsError(
            f"{path} is no access list of format {ACCESS_FORMAT}; run `hive certs renew` for any "
            "member of the site, then copy the one that it has written to each machine"
        )
    return section


def _check_encrypted(endpoint: str) -> None:
    protocol, address = _parts(endpoint)
    if protocol != "tls" or not is_address(address):
        raise SettingsError(f"endpoint {endpoint!r}; allowed with certificates: tls/HOST:PORT")


def _check_bare(endpoint: str) -> None:
    protocol, address = _parts(endpoint)
    is_ours = is_address(address) and is_loopback(address.rpartition(":")[0])
    if protocol != "tcp" or not is_ours:
        raise SettingsError(
            f"endpoint {endpoint!r}; allowed without certificates: tcp/127.0.0.1:PORT. To reach "
            "other machines, make certificates with `hive certs`"
        )


def _parts(endpoint: str) -> tuple[str, str]:
    """Return an endpoint's protocol and address, without what Zenoh allows after these."""
    protocol, _, rest = endpoint.partition("/")
    return protocol, re.split("[?#]", rest, maxsplit=1)[0]


def is_address(text: str) -> bool:
    """Return whether a text is HOST:PORT, such as 192.168.1.11:7447; in brackets for IPv6."""
    return _ADDRESS.fullmatch(text) is not None and int(text.rpartition(":")[2]) <= _HIGHEST_PORT


def is_loopback(host: str) -> bool:
    """Return whether only this machine reaches an address, which may be in brackets."""
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False
