# SPDX-License-Identifier: BSD-3-Clause
"""Tells a robot that joins a running fleet the fleet's settings.

Costs of two models cannot be compared: a robot that bids by another model than the rest would get
every task, or none. So `launch_fleet` sets the fleet's settings as parameters, and `robot.launch`
asks for them here where the user gives none.
"""

from __future__ import annotations

import os
import xmlrpc.client
from typing import Any

import attrs
import click

from fleet_manager.client.client import DEFAULT_URI
from fleet_manager.config.fleet_file import Fleet

_CALLER = "/fleet_setting"
_FOUND = 1


@click.command()
@click.argument("name", type=click.Choice(["cost_model", "distance"]))
def fleet_setting(name: str) -> None:
    """Print a setting of the fleet that runs on ROS_MASTER_URI; its default where none runs."""
    default = str(attrs.fields_dict(Fleet)[name].default)
    click.echo(_asked(f"/fleet/{name}") or default, nl=False)


def _asked(parameter: str) -> str:
    """Return a parameter of the ROS master; empty where there is none, or no master answers."""
    uri = os.environ.get("ROS_MASTER_URI", DEFAULT_URI)
    try:
        with xmlrpc.client.ServerProxy(uri) as master:
            answer: Any = master.getParam(_CALLER, parameter)
    except (OSError, xmlrpc.client.Error):
        return ""
    code, _, value = answer
    return str(value) if code == _FOUND else ""


def main() -> None:
    """Run with this process's arguments."""
    fleet_setting()
