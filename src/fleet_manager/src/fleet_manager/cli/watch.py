# SPDX-License-Identifier: BSD-3-Clause
"""The commands that look at the hive and change nothing: `tasks`, `robots`, `watch`, `events`."""

from __future__ import annotations

import json
import shutil
from datetime import datetime
from typing import TYPE_CHECKING

import click

from fleet_manager.cli.outside import open_tasks, pass_outside
from fleet_manager.client import tables
from fleet_manager.client.client import HiveClient
from fleet_manager.client.words import changes

if TYPE_CHECKING:
    from fleet_manager.cli.outside import Outside
    from fleet_manager.client.hive_view import HiveView, Report

_HOME_AND_CLEAR = "\x1b[H\x1b[J"
_OTHER_SCREEN, _FIRST_SCREEN = "\x1b[?1049h\x1b[?25l", "\x1b[?25h\x1b[?1049l"


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print a JSON list instead of a table.")
@click.option("--all", "everything", is_flag=True, help="Show tasks that have ended as well.")
@pass_outside
def tasks(outside: Outside, as_json: bool, everything: bool) -> None:
    """Show the tasks on the list.

    \b
    Examples:
      hive tasks
      hive tasks --all --json | jq '.[] | select(.state == "FAILED")'
    """  # noqa: D301  (to click, \b means: keep the lines)
    with outside.connect(()) as link:
        client = HiveClient(link)
        client.fetch_tasks()
    records = open_tasks(client.view, everything=everything)
    if as_json:
        click.echo(json.dumps([tables.task_data(record) for record in records], indent=2))
    elif records:
        click.echo("\n".join(tables.tasks_table(records)))
    else:
        ended = len(client.view.tasks)
        click.echo(f"no open tasks; {ended} have ended" if ended else "no tasks", err=True)


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print a JSON list instead of a table.")
@pass_outside
def robots(outside: Outside, as_json: bool) -> None:
    """Show the robots: state, battery, load, place, task, queue.

    \b
    Examples:
      hive robots
      hive robots --json | jq '.[] | select(.charge < 0.2) | .name'
    """  # noqa: D301  (to click, \b means: keep the lines)
    with outside.connect(()) as link:
        client = HiveClient(link)
        client.fetch_robots()
    known = tables.robots_of(client.view)
    if as_json:
        click.echo(json.dumps([tables.robot_data(robot) for robot in known], indent=2))
    elif known:
        click.echo("\n".join(tables.robots_table(known)))
    else:
        click.echo("no robots; a blackboard is there", err=True)


@click.command()
@click.option("--all", "everything", is_flag=True, help="Show tasks that have ended as well.")
@click.option(
    "--every",
    type=click.FloatRange(0.1, 60),
    default=0.5,
    show_default=True,
    help="Time between two pictures [s].",
)
@pass_outside
def watch(outside: Outside, everything: bool, every: float) -> None:
    """Show tasks and robots live, until Ctrl-C.

    In a terminal the picture is drawn anew in its place; elsewhere the pictures follow each other.
    """
    in_place = click.get_text_stream("stdout").isatty()
    with outside.connect(()) as link:
        client = HiveClient(link)
        try:
            if in_place:
                click.echo(_OTHER_SCREEN, nl=False)
            while True:
                client.pump(lambda: False, every)
                lines = _picture(client.view, everything, in_place)
                click.echo(_HOME_AND_CLEAR if in_place else "", nl=False)
                click.echo("\n".join(lines), nl=not in_place)
        finally:
            if in_place:
                click.echo(_FIRST_SCREEN, nl=False)


@click.command()
@pass_outside
def events(outside: Outside) -> None:
    """Say every change of tasks, robots and blackboard in words, until Ctrl-C.

    The first lines say how things stand now.
    """

    def tell(view: HiveView, report: Report) -> None:
        for sentence in changes(view, report):
            click.echo(f"{datetime.now().astimezone():%H:%M:%S}  {sentence}")

    with outside.connect(()) as link:
        HiveClient(link, tell).pump(lambda: False, None)


def _picture(view: HiveView, everything: bool, in_place: bool) -> list[str]:
    """Return the lines of one picture, cut to the terminal where it is drawn in its place."""
    ended = sum(record.state.is_terminal for record in view.tasks.values())
    records = open_tasks(view, everything=everything)
    lines = [tables.who_leads(view), ""]
    lines += [*tables.robots_table(tables.robots_of(view)), ""]
    lines += tables.tasks_table(records)
    lines += ["", f"{len(view.tasks) - ended} tasks open, {ended} ended"]
    if not in_place:
        return [*lines, ""]
    size = shutil.get_terminal_size()
    return tables.fit(lines, size.columns)[: size.lines]
