# SPDX-License-Identifier: BSD-3-Clause
"""How an operator's program reaches a hive over Zenoh: by a fleet file, or by endpoints."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import attrs

from blackboard.zenoh.access import Role
from blackboard.zenoh.session import CERTIFICATE, read_own
from blackboard.zenoh.settings import ZenohSettings
from fleet_manager.certs.issuing import read_issued
from fleet_manager.config.fleet_file import read_connections
from fleet_manager.config.zenoh_launch import connection_of
from fleet_manager.errors import InputError
from hive_common.structuring import structure

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from fleet_manager.certs.issuing import Issued
    from fleet_manager.config.fleet_file import Fleet
    from hive_common.pose import Pose
    from hive_common.zone import Zone

_ENDPOINT = re.compile("(tcp|tls)/")


@attrs.frozen(kw_only=True)
class OperatorSite:
    """How an operator's program connects, and what is known of the building."""

    settings: ZenohSettings
    places: Mapping[str, Pose] = attrs.field(factory=dict)
    """By name, in the map frame: the chargers of the fleet file."""
    zones: tuple[Zone, ...] = ()
    """Those of the fleet file."""
    why_silent: str = ""
    """Why the hive would drop what this program asks for; empty if it would not."""

    @property
    def address(self) -> str:
        """What it connects to, for a person."""
        return ", ".join(self.settings.connect)


def operator_site(ends: Sequence[str], certificates: str = "") -> OperatorSite:
    """Return how an operator's program connects.

    Args:
        ends: One fleet file, by its name in `fleets/` or by its path; or endpoints such as
            `tls/192.168.1.10:7447`: those of all members, or that of one router.
        certificates: The folder of the operator's certificate. Where it is empty, a fleet file
            says it; with endpoints, only this machine is reached then.

    Raises:
        InputError: These are not allowed, no operator of the fleet has its folder here, or the
            certificate is another one's than an operator's or a viewer's.
        blackboard.errors.SettingsError: An endpoint is not allowed, or the certificate cannot be
            used.
        hive_common.errors.FileError: There is no such fleet, or its connections have a mistake.
    """
    site = _site(ends, certificates)
    # What cannot be used is found now, not when a session is opened.
    site.settings.session()
    site.settings.own("")
    if (folder := site.settings.folder) is None:
        return site
    return attrs.evolve(site, why_silent=_why_silent(read_issued(folder / CERTIFICATE), folder))


def _why_silent(issued: Issued, folder: Path) -> str:
    """Return why a certificate may ask for nothing; empty if it may.

    Raises:
        InputError: It is a member's, which has a process of its own, or a router's.
    """
    remedy = "`hive certs add NAME --role operator` makes one of an operator"
    if issued.role not in {Role.OPERATOR, Role.VIEWER}:
        raise InputError(
            f"{folder} has the certificate of a {issued.role.value}; allowed: that of an operator "
            f"or a viewer. {remedy}"
        )
    if issued.role is Role.OPERATOR:
        return ""
    return f"{issued.name} has a viewer's certificate, and may only listen; {remedy}"


def _site(ends: Sequence[str], certificates: str) -> OperatorSite:
    folder = str(Path(certificates).expanduser().absolute()) if certificates else ""
    if all(map(_ENDPOINT.match, ends)):
        return OperatorSite(
            settings=ZenohSettings(connect=tuple(ends), certificates=folder, own_master=False)
        )
    if len(ends) > 1:
        raise InputError(
            f"--connect {' '.join(ends)}; allowed: one fleet file, or endpoints such as "
            "tls/192.168.1.10:7447"
        )
    fleet = read_connections(ends[0])
    if fleet.transport != "zenoh":
        raise InputError(
            f"{fleet.path} has transport: {fleet.transport}; allowed: zenoh. A hive on ROS is "
            "found at ROS_MASTER_URI, without --connect"
        )
    settings = structure(connection_of(fleet, _operator_of(fleet, folder)), ZenohSettings)
    return OperatorSite(
        settings=attrs.evolve(
            settings, certificates=folder or settings.certificates, own_master=False
        ),
        places={charger.name: charger.pose for charger in fleet.chargers or ()},
        zones=fleet.zones,
    )


def _operator_of(fleet: Fleet, folder: str) -> str:
    """Return which operator of a fleet this is: the first whose certificate is on this machine.

    Raises:
        InputError: None is, or the fleet has no operator.
        blackboard.errors.SettingsError: The folder that was given is none of a certificate.
    """
    if folder:
        return read_own(Path(folder)).name
    site = fleet.zenoh
    if not site.operators:
        raise InputError(f"{fleet.path} names no operator; name one at `zenoh: operators:`")
    if not site.certificates:
        return site.operators[0]
    for name in site.operators:
        if (Path(site.certificates) / name).is_dir():
            return name
    raise InputError(
        f"{site.certificates} has no folder of {' or '.join(site.operators)}; copy there the one "
        "that `hive certs add NAME --role operator` has made, or give it with --certificates"
    )
