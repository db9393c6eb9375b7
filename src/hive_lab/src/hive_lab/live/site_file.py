# SPDX-License-Identifier: BSD-3-Clause
"""Writes the fleet file of a hive over Zenoh, and runs its routers as an operator does."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import yaml

from fleet_manager.config.fleet_file import read_fleet
from hive_common.resources import node_file

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from fleet_manager.config.fleet_file import Fleet

_SPACING = 3.0
"""Between robots, which may not touch [m]."""


def write_fleet(path: Path, robots: Sequence[str], zenoh: Mapping[str, Any]) -> Fleet:
    """Write a fleet file, and return what was read from it.

    Args:
        path: Of the file.
        robots: Their names.
        zenoh: Its key of that name.
    """
    entries = [
        {"name": name, "model": "mir100", "pose": [_SPACING * place, 0.0, 0.0]}
        for place, name in enumerate(robots)
    ]
    content = {"transport": "zenoh", "zenoh": dict(zenoh), "robots": entries}
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return read_fleet(str(path))


def router_command(fleet: Fleet, name: str) -> tuple[str, ...]:
    """Return the command that runs a router of a fleet."""
    hive = str(node_file("fleet_manager", "hive"))
    return (sys.executable, hive, "router", name, "--fleet", str(fleet.path))
