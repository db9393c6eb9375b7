# SPDX-License-Identifier: BSD-3-Clause
"""The command `robot`: out of service, back in, to a charger, or to a place with its load."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

import click

from blackboard.robot.service import PUT_DOWN, put_down_word
from fleet_manager.cli.context import ROBOT_NAME, ask_first, pass_context, yes_option
from fleet_manager.cli.goals import GoalParam
from fleet_manager.client import consequences
from fleet_manager.client.client import HiveClient

if TYPE_CHECKING:
    from fleet_manager.cli.context import CliContext
    from fleet_manager.cli.goals import Goal

_PUT_DOWN = "put-down"
_WORDS = MappingProxyType({"out": "defect", "in": "idle", "charge": "charge", _PUT_DOWN: PUT_DOWN})
"""What a robot is told on `set_state`."""


@click.command()
@click.argument("robot", metavar="NAME", type=ROBOT_NAME)
@click.argument("what", metavar="|".join(_WORDS), type=click.Choice(list(_WORDS)))
@click.argument("place", required=False, type=GoalParam())
@yes_option
@pass_context
def robot(context: CliContext, robot: str, what: str, place: Goal | None, yes: bool) -> None:
    """Take the robot NAME out of service, put it back in, or send it to charge or to unload.

    \b
      out     it stops and hands back its tasks, until it is put back in
      in      it takes tasks again; say so only when its load, if it had any, has been taken off
      charge  it puts down its load, hands back its tasks, goes to the nearest free charger, and
              takes tasks again when it is full
      put-down PLACE  it brings the load that was left on board to PLACE, a goal as for `hive add`,
              puts it down there, and takes tasks again

    \b
    Examples:
      hive robot robot3 out
      hive robot robot3 in
      hive robot robot3 put-down 'test cell'

    Exits with 0 when the robot has obeyed, with 1 when there is no such robot or it could not.
    """  # noqa: D301  (to click, \b means: keep the lines)
    if (place is not None) is not (what == _PUT_DOWN):
        raise click.UsageError(f"a PLACE belongs to {_PUT_DOWN}, and only there")
    with context.connect(()) as link:
        client = HiveClient(link)
        row = client.fetch_robot(robot)
        word = _WORDS[what]
        if place is not None:
            word = put_down_word(place.pose(link.places() if place.name else {}))
        if what == "out":
            client.fetch_tasks()
            ask_first(consequences.of_taking_out(row, client.state.records.values()), yes=yes)
        told = client.command(robot, word)
    because = f": {told.reason}" if told.reason else ""
    click.echo(f"{robot} is {told.state.name.lower()}{because}", err=True)
