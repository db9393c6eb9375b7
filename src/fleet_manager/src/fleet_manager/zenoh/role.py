# SPDX-License-Identifier: BSD-3-Clause
"""What a certificate allows an operator's program to do."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.zenoh.access import Role
from blackboard.zenoh.session import CERTIFICATE

if TYPE_CHECKING:
    from fleet_manager.config.zenoh_operator import OperatorSite


def why_silent(site: OperatorSite) -> str:
    """Return why the hive would drop what this program asks for; empty if it would not.

    Raises:
        fleet_manager.errors.InputError: The certificate cannot be read.
    """
    # Reading a certificate takes a library that takes 0.1 s to import.
    from fleet_manager.certs.issuing import read_issued  # noqa: PLC0415

    if (folder := site.settings.folder) is None:
        return ""
    issued = read_issued(folder / CERTIFICATE)
    if issued.role is Role.OPERATOR:
        return ""
    return (
        f"{issued.name} has the certificate of a {issued.role.value}, which may listen here and "
        f"no more; use that of an operator, which `hive certs add NAME --role operator` makes"
    )
