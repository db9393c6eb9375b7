# SPDX-License-Identifier: BSD-3-Clause
"""The command `router`: passes on what the members of a hive over Zenoh say."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import click

from blackboard.zenoh.access import Role
from blackboard.zenoh.router import running_router
from blackboard.zenoh.session import CERTIFICATE
from blackboard.zenoh.settings import ZenohSettings
from fleet_manager.certs.issuing import read_issued
from fleet_manager.config.fleet_file import read_connections
from fleet_manager.config.zenoh_launch import connection_of
from fleet_manager.errors import InputError
from hive_common.structuring import structure

if TYPE_CHECKING:
    from pathlib import Path

    from fleet_manager.config.fleet_file import Fleet


@click.command()
@click.argument("name")
@click.option(
    "--fleet", required=True, metavar="FLEET", help="The fleet: a name in fleets/ or a path."
)
def router(name: str, fleet: str) -> None:
    """Run the router NAME of a fleet until it is ended.

    Members, operators and viewers of a hive with `transport: zenoh` connect to a router where they
    cannot or shall not connect to each other: over several networks, behind address translation,
    or because there are many. See docs/many-machines.md.

    \b
    Example:
      hive router hall_a --fleet /etc/robo-hive/fleet.yaml
    """  # noqa: D301  (to click, \b means: keep the lines)
    settings = _settings(read_connections(fleet), name)
    with running_router(settings, click.echo):
        where = ", ".join(settings.listen)
        click.echo(f"{name} is a router and listens at {where}")
        wait_for_signal()


def wait_for_signal() -> None:
    """Wait until a signal ends this process."""
    threading.Event().wait()


def _settings(fleet: Fleet, name: str) -> ZenohSettings:
    """Return how a router of a fleet takes part.

    Raises:
        InputError: The fleet has no such router, or its certificate is not a router's.
    """
    known = [each.name for each in fleet.zenoh.routers]
    if name not in known:
        allowed = ", ".join(known) or "none; name it at `zenoh: routers:`"
        raise InputError(f"{fleet.path} has no router {name!r:.80}; allowed: {allowed}")
    settings = structure(connection_of(fleet, name), ZenohSettings)
    if settings.folder is not None:
        settings.own(name)
        _check_role(settings.folder, name)
    return settings


def _check_role(folder: Path, name: str) -> None:
    """Raise InputError unless a certificate is a router's: others would not listen to it."""
    role = read_issued(folder / CERTIFICATE).role
    if role is not Role.ROUTER:
        raise InputError(
            f"{folder} has the certificate of a {role.value}; allowed: that of a router. Run "
            f"`hive certs revoke {name}`, then `hive certs add {name} --role router`"
        )
