# SPDX-License-Identifier: BSD-3-Clause
"""Tells a robot that joins a running fleet the fleet's settings.

Costs of two models cannot be compared: a robot that bids by another model than the rest would get
every task, or none. So `launch_fleet` sets the fleet's settings as parameters, and `robot.launch`
asks for them here where the user gives none.
"""

from __future__ import annotations

import attrs
import click

from fleet_manager.config.fleet_file import Fleet
from fleet_manager.ros.launch_checked import asked

_CALLER = "/fleet_setting"


@click.command()
@click.argument("name", type=click.Choice(["cost_model", "distance"]))
def fleet_setting(name: str) -> None:
    """Print a setting of the fleet that runs on ROS_MASTER_URI; its default where none runs."""
    default = str(attrs.fields_dict(Fleet)[name].default)
    click.echo(asked(_CALLER, f"/fleet/{name}") or default, nl=False)


def main() -> None:
    """Run with this process's arguments."""
    fleet_setting()
