# SPDX-License-Identifier: BSD-3-Clause
"""Says on what machine and with which versions a report or a benchmark was made."""

from __future__ import annotations

import os
import platform
import re
from importlib import metadata
from pathlib import Path

from hive_common.resources import package_folder


def machine() -> dict[str, str | int | float]:
    """Return processor, number of cores that may be used, memory [GB], and system."""
    return {
        "processor": _found(Path("/proc/cpuinfo"), r"^model name\s*:\s*(.+)$") or "unknown",
        "cores": len(os.sched_getaffinity(0)),
        "memory": round(int(_found(Path("/proc/meminfo"), r"^MemTotal:\s*(\d+)") or 0) / 1e6, 1),
        "system": _found(Path("/etc/os-release"), r'^PRETTY_NAME="?([^"\n]+)')
        or platform.system(),
        "kernel": platform.release(),
    }


def versions() -> dict[str, str]:
    """Return the versions of this package and of what its results depend on."""
    manifest = package_folder("fleet_manager") / "package.xml"
    return {
        "robo_hive": _found(manifest, r"<version>([^<]+)</version>") or "unknown",
        "python": platform.python_version(),
        "ros": os.environ.get("ROS_DISTRO", "unknown"),
        **{name: _version(name) for name in ("ompl", "numpy", "rospy")},
    }


def _found(path: Path, pattern: str) -> str:
    """Return the first group of a pattern in a file; empty where there is none."""
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
