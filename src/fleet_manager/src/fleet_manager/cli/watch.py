# SPDX-License-Identifier: BSD-3-Clause
"""The commands that show the hive: `tasks`, `robots`, `watch`, `events`."""

from __future__ import annotations

import json
import shutil
from datetime import datetime
from typing import TYPE_CHECKING

import click

from blackboard.consensus.task_list import TaskList
from fleet_manager.cli.context import pass_context
from fleet_manager.client import tables
from fleet_manager.client.client import HiveClient
from fleet_manager.client.formats import counted
from fleet_manager.client.leadership import Standing
from fleet_manager.errors import NoHiveError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fleet_manager.cli.context import CliContext
    from fleet_manager.client.hive_state import HiveState
    from fleet_manager.client.reports import Report
    from fleet_manager.client.rows import TaskRow
    from fleet_manager.client.words import Event

_CLOCK = 1.0  # [s] in which a simulated time is heard, unless nobody tells it
_EARLIER = "earlier "  # in the place of a time
_HOME_AND_CLEAR = "\x1b[H\x1b[J"
_OTHER_SCREEN, _FIRST_SCREEN = "\x1b[?1049h\x1b[?25l", "\x1b[?25h\x1b[?1049l"


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print a JSON list instead of a table.")
@click.option("--all", "everything", is_flag=True, help="Show ended tasks as well.")
@pass_context
def tasks(context: CliContext, as_json: bool, everything: bool) -> None:
    """Show the tasks on the list.

    \b
    Examples:
      hive tasks
      hive tasks --all --json | jq '.[] | select(.state == "FAILED")'

    Where there is no leader, the first line on stderr says so, and the exit code is 3.
    """  # noqa: D301  (to click, \b means: keep the lines)
    with context.connect(()) as link:
        client = HiveClient(link)
        client.fetch_tasks()
        now = link.hive_time(_CLOCK)
        standing = _tell_leader(client)
    rows = _tasks(client.state, everything=everything)
    if as_json:
        click.echo(json.dumps([tables.task_data(row, now) for row in rows], indent=2))
    elif rows:
        click.echo("\n".join(tables.tasks_table(rows, now, client.state.robots)))
    else:
        ended = len(client.state.records)
        click.echo(f"no open tasks; {ended} have ended" if ended else "no tasks", err=True)
    _demand_leader(standing)


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print a JSON list instead of a table.")
@pass_context
def robots(context: CliContext, as_json: bool) -> None:
    """Show the robots: state, battery, load, place, task, queue.

    \b
    Examples:
      hive robots
      hive robots --json | jq '.[] | select(.charge < 0.2) | .name'

    Robots that the hive no longer hears are OFFLINE. Where there is no leader, the first line on
    stderr says so, and the exit code is 3.
    """  # noqa: D301  (to click, \b means: keep the lines)
    with context.connect(()) as link:
        client = HiveClient(link)
        client.fetch_robots()
        standing = _tell_leader(client)
    known = tables.robots_of(client.state)
    if as_json:
        click.echo(json.dumps([tables.robot_data(robot) for robot in known], indent=2))
    elif known:
        click.echo("\n".join(tables.robots_table(known)))
    else:
        click.echo("no robots; a blackboard is there", err=True)
    _demand_leader(standing)


@click.command()
@click.option("--all", "everything", is_flag=True, help="Show ended tasks as well.")
@click.option(
    "--every",
    type=click.FloatRange(0.1, 60),
    default=0.5,
    show_default=True,
    help="Time between two updates [s].",
)
@pass_context
def watch(context: CliContext, everything: bool, every: float) -> None:
    """Show tasks and robots live, until Ctrl-C.

    A terminal is redrawn in place; other output grows with every update.
    """
    in_place = click.get_text_stream("stdout").isatty()
    with context.connect(()) as link:
        client = HiveClient(link)
        try:
            if in_place:
                click.echo(_OTHER_SCREEN, nl=False)
            while True:
                client.pump(lambda: False, every)
                lines = _screen(client, everything, in_place)
                click.echo(_HOME_AND_CLEAR if in_place else "", nl=False)
                click.echo("\n".join(lines), nl=not in_place)
        finally:
            if in_place:
                click.echo(_FIRST_SCREEN, nl=False)


@click.command()
@pass_context
def events(context: CliContext) -> None:
    """Print every change of tasks, robots and blackboard in words, until Ctrl-C.

    The first lines say how things stand now, and what the list tells of earlier.
    """
    told_of_list = False

    def tell(report: Report | None, events: Sequence[Event]) -> None:
        nonlocal told_of_list
        is_past = isinstance(report, TaskList) and not told_of_list
        told_of_list |= is_past
        when = _EARLIER if is_past else f"{datetime.now().astimezone():%H:%M:%S}"
        for event in events:
            click.echo(f"{when}  {event.text}")

    with context.connect(()) as link:
        HiveClient(link, tell).pump(lambda: False, None)


def _who_leads(client: HiveClient) -> str:
    return tables.who_leads(client.state, client.link.now(), client.link.hive_time())


def _tell_leader(client: HiveClient) -> Standing:
    """Say that there is no leader, and why, where that is so; return whether there is one."""
    standing = client.fetch_leader()
    if standing is not Standing.LEADER:
        why = next(iter(client.link.troubles()), "")
        click.echo("; ".join(filter(None, [_who_leads(client), why])), err=True)
    return standing


def _demand_leader(standing: Standing) -> None:
    """Exit as where nobody answers; the first line has said so."""
    if standing is not Standing.LEADER:
        raise click.exceptions.Exit(NoHiveError.exit_code)


def _screen(client: HiveClient, everything: bool, in_place: bool) -> list[str]:
    """Return the lines of one update, cut to the terminal where it is redrawn in place."""
    state, now = client.state, client.link.hive_time()
    total, still_open = len(state.records), len(_tasks(state, everything=False))
    lines = [_who_leads(client), ""]
    lines += [*tables.robots_table(tables.robots_of(state)), ""]
    lines += tables.tasks_table(_tasks(state, everything=everything), now, state.robots)
    lines += ["", f"{counted(still_open, 'task')} open, {total - still_open} ended"]
    if not in_place:
        return [*lines, ""]
    size = shutil.get_terminal_size()
    return tables.fit(lines, size.columns)[: size.lines]


def _tasks(state: HiveState, *, everything: bool) -> list[TaskRow]:
    """Return the open tasks, or all of them, in the order they were posted."""
    rows = (row for row in state.tasks.values() if not row.is_refused)
    return [row for row in rows if everything or row.is_open]
