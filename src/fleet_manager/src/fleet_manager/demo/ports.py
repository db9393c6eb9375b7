# SPDX-License-Identifier: BSD-3-Clause
"""Finds a port for a ROS master that no second demo on the machine can take as well."""

from __future__ import annotations

import contextlib
import fcntl
import os
import socket
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from fleet_manager.errors import StartError

if TYPE_CHECKING:
    from collections.abc import Iterator

MASTER_PORTS = range(11320, 11400)
"""Above the standard 11311, so that a hive that somebody runs there is left alone."""


@contextlib.contextmanager
def reserved_port(candidates: range = MASTER_PORTS) -> Iterator[int]:
    """Reserve a port of this machine for as long as the context lasts.

    Looking whether a port is free and using it are two moments, and a second demo may look between
    them. So a lock on a file of the port's own is held; the system releases it with the process,
    however that ends.

    Args:
        candidates: Ports to choose from, the first free one first.

    Yields:
        The port.

    Raises:
        StartError: All are taken.
    """
    for port in candidates:
        lock = _locked(Path(tempfile.gettempdir()) / f"robo-hive-port-{port}.lock")
        if lock is None:
            continue
        try:
            if _is_free(port):
                yield port
                return
        finally:
            os.close(lock)
    raise StartError(
        f"no free port for a ROS master from {candidates[0]} to {candidates[-1]}; "
        "end another demo, or set ROS_MASTER_URI"
    )


def _locked(path: Path) -> int | None:
    """Return the descriptor of a locked file, or None where another process holds the lock."""
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except PermissionError:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        return None
    return descriptor


def _is_free(port: int) -> bool:
    """Return whether nobody listens on a port of any address of this machine."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("", port))
        except OSError:
            return False
    return True
