# SPDX-License-Identifier: BSD-3-Clause
"""Proof that a process has ended: its port refuses connections."""

from __future__ import annotations

import socket

_PATIENCE = 0.2
"""Time that a port may take to refuse [s]; a host that is cut off never answers."""


def refuses(host: str, port: int) -> bool:
    """Return whether a port refuses connections; only a machine that is up can do that."""
    try:
        with socket.create_connection((host, port), timeout=_PATIENCE):
            return False
    except ConnectionRefusedError:
        return True
    except (OSError, OverflowError):  # also a name or a number that is none
        return False
