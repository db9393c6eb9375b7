# SPDX-License-Identifier: BSD-3-Clause
"""The command `robot`: takes a robot out of service, puts it back, or sends it to charge."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

import click

from fleet_manager.cli.context import ROBOT_NAME, ask_first, pass_context, yes_option
from fleet_manager.client import consequences
from fleet_manager.client.client import HiveClient

if TYPE_CHECKING:
    from fleet_manager.cli.context import CliContext

_WORDS = MappingProxyType({"out": "defect", "in": "idle", "charge": "charge"})
"""What a robot is told on `set_state`."""


@click.command()
@click.argument("robot", metavar="NAME", type=ROBOT_NAME)
@click.argument("what", metavar="out|in|charge", type=click.Choice(list(_WORDS)))
@yes_option
@pass_context
def robot(context: CliContext, robot: str, what: str, yes: bool) -> None:
    """Take the robot NAME out of service, put it back in, or send it to charge.

    \b
      out     it stops and hands back its tasks, until it is put back in
      in      it takes tasks again; say so only when its load, if it had any, has been taken off
      charge  it puts down its load, hands back its tasks, goes to the nearest free charger, and
              takes tasks again when it is full

    \b
    Examples:
      hive robot robot3 out
      hive robot robot3 in

    Exits with 0 when the robot has obeyed, with 1 when there is no such robot or it could not.
    """  # noqa: D301  (to click, \b means: keep the lines)
    with context.connect(()) as link:
        client = HiveClient(link)
        row = client.fetch_robot(robot)
        if what == "out":
            client.fetch_tasks()
            ask_first(consequences.of_taking_out(row, client.state.records.values()), yes=yes)
        told = client.command(robot, _WORDS[what])
    because = f": {told.reason}" if told.reason else ""
    click.echo(f"{robot} is {told.state.name.lower()}{because}", err=True)
