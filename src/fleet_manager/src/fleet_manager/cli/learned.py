# SPDX-License-Identifier: BSD-3-Clause
"""The command `learned`: what robots have learned of their steps, and how well they predict."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

from blackboard.costing.saved_experience import as_plain
from fleet_manager.cli.context import ROBOT_NAME, ask_first, pass_context, yes_option
from fleet_manager.client import tables
from fleet_manager.client.client import HiveClient
from fleet_manager.client.learned import (
    FORMULA,
    have_forget,
    learned_table,
    read_learned,
    robot_lines,
    what_is_lost,
)
from fleet_manager.errors import NotDoneError

if TYPE_CHECKING:
    from blackboard.costing.saved_experience import SavedExperience
    from fleet_manager.cli.context import CliContext


@click.command()
@click.argument("robot", required=False, type=ROBOT_NAME)
@click.option("--json", "as_json", is_flag=True, help="Print JSON: what each robot keeps.")
@click.option("--forget", is_flag=True, help="Have ROBOT forget it and bid by the formula again.")
@yes_option
@pass_context
def learned(
    context: CliContext, robot: str | None, as_json: bool, forget: bool, yes: bool
) -> None:
    """Show what robots have learned of their steps, or all that there is to say of ROBOT.

    Errors are those of the last tasks, at most 100: the median share by which a prediction is
    off, by the formula → as learned. With ROBOT there is a line for each 20 tasks, the oldest
    first; 19 OF 20 tasks are off by no more than that, and KEPT is the share of tasks that took no
    more than predicted and the margin, which nine of ten should.

    \b
    TIME MARGIN    how much longer nine of ten tasks take at most that are predicted to take
                   60 s; it grows with the root of the time
    ENERGY MARGIN  how much more energy nine of ten tasks draw at most than predicted
    CLIPPED        drives predicted outside of what is allowed: at least the time at top speed, at
                   most 3 times the formula's and 10 s

    After repairs, or where the way has been changed, a robot learns anew by itself; --forget lets
    it begin at once.

    \b
    Examples:
      hive learned
      hive learned robot1
      hive learned robot1 --forget

    Exits with 1 where nothing is known of ROBOT.
    """  # noqa: D301  (to click, \b means: keep the lines)
    if forget:
        _forget(context, robot, as_json=as_json, yes=yes)
        return
    if yes:
        raise click.UsageError("--yes belongs to --forget, and only there")
    if robot is None:
        _show_all(context, as_json=as_json)
    else:
        _show(context, robot, as_json=as_json)


def _forget(context: CliContext, robot: str | None, *, as_json: bool, yes: bool) -> None:
    """Have a robot forget, after a question."""
    if robot is None or as_json:
        raise click.UsageError("--forget is for one ROBOT, and without --json")
    with context.connect(()) as link:
        client = HiveClient(link)
        client.fetch_robot(robot)
        ask_first(what_is_lost(robot, link.learned_of(robot)), yes=yes)
        have_forget(client, robot)
    click.echo(f"{robot} has forgotten what it had learned and {FORMULA}", err=True)


def _show(context: CliContext, robot: str, *, as_json: bool) -> None:
    """Show all of one robot."""
    with context.connect(()) as link:
        HiveClient(link).find_robot(robot)
        saved = read_learned(robot, link.learned_of(robot))
    if as_json:
        click.echo(json.dumps({robot: as_plain(saved)}, indent=2))
    else:
        click.echo("\n".join(robot_lines(robot, saved)))


def _show_all(context: CliContext, *, as_json: bool) -> None:
    """Show a line for each robot, or the data of those of which something is known."""
    with context.connect(()) as link:
        client = HiveClient(link)
        client.fetch_robots()
        names = [row.status.robot_id for row in tables.robots_of(client.state)]
        contents = {name: link.learned_of(name) for name in names}
    known: dict[str, SavedExperience | str] = {}
    for name, content in contents.items():
        try:
            known[name] = read_learned(name, content)
        except NotDoneError as error:
            known[name] = str(error)
    if as_json:
        data = {
            name: None if isinstance(each, str) else as_plain(each) for name, each in known.items()
        }
        for each in known.values():
            if isinstance(each, str):
                click.echo(each, err=True)
        click.echo(json.dumps(data, indent=2))
    elif known:
        click.echo("\n".join(learned_table(known)))
    else:
        click.echo("no robots; a blackboard is there", err=True)
