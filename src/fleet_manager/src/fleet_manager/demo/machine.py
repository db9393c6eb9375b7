# SPDX-License-Identifier: BSD-3-Clause
"""What a run needs to know of this machine: hardware and versions, a free port, a screen."""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import os
import platform
import re
import socket
import tempfile
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

from fleet_manager.errors import StartError
from hive_common.resources import package_folder

if TYPE_CHECKING:
    from collections.abc import Iterator

MASTER_PORTS = range(11320, 11400)  # above the standard 11311, which is left to other hives


def machine() -> dict[str, str | int | float]:
    """Return processor, usable cores, memory [GB], and system."""
    return {
        "processor": _found(Path("/proc/cpuinfo"), r"^model name\s*:\s*(.+)$") or "unknown",
        "cores": len(os.sched_getaffinity(0)),
        "memory": round(int(_found(Path("/proc/meminfo"), r"^MemTotal:\s*(\d+)") or 0) / 1e6, 1),
        "system": _found(Path("/etc/os-release"), r'^PRETTY_NAME="?([^"\n]+)')
        or platform.system(),
        "kernel": platform.release(),
    }


def versions() -> dict[str, str]:
    """Return the versions on which results depend."""
    manifest = package_folder("fleet_manager") / "package.xml"
    return {
        "robo_hive": _found(manifest, r"<version>([^<]+)</version>") or "unknown",
        "python": platform.python_version(),
        "ros": os.environ.get("ROS_DISTRO", "unknown"),
        **{name: _version(name) for name in ("ompl", "numpy", "rospy")},
    }


def _found(path: Path, pattern: str) -> str:
    """Return the first group of a pattern in a file; empty where it is not found."""
    try:
        match = re.search(pattern, path.read_text(encoding="utf-8"), re.MULTILINE)
    except OSError:
        return ""
    return match[1].strip() if match else ""


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


def screen_is_usable() -> bool:
    """Return whether DISPLAY names an X server that lets this process in.

    In a container or behind ssh DISPLAY often leads nowhere, and RViz would end the whole demo.
    """
    if not os.environ.get("DISPLAY"):
        return False
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError:
        return False
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XOpenDisplay.argtypes = [ctypes.c_char_p]
    x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    display = x11.XOpenDisplay(None)
    if not display:
        return False
    x11.XCloseDisplay(display)
    return True


@contextlib.contextmanager
def reserved_port(candidates: range = MASTER_PORTS) -> Iterator[int]:
    """Reserve the first free port of some candidates while the context lasts.

    A second demo may look for a port before the first one uses it. So a file of the port's own is
    locked; the system releases the lock with the process, however that ends.

    Raises:
        StartError: All ports are taken.
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
    """Return whether no process listens on a port of this machine."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("", port))
        except OSError:
            return False
    return True
