# SPDX-License-Identifier: BSD-3-Clause
"""The commands for a single task: `add` and `cancel`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from blackboard.auction.splitting import unfinished_parts
from blackboard.domain.task import MAX_PRIORITY, Task, TaskState, TaskType
from fleet_manager.cli.context import (
    OPEN_TASK_ID,
    ask_first,
    pass_context,
    yes_option,
)
from fleet_manager.cli.goals import Goal, GoalParam
from fleet_manager.client import consequences
from fleet_manager.client.client import HiveClient, id_of
from fleet_manager.client.outlook import outlook
from fleet_manager.errors import NotDoneError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from fleet_manager.cli.context import CliContext
    from fleet_manager.client.reports import Report
    from fleet_manager.client.words import Event

_TYPE_NAMES = [kind.name for kind in TaskType]
SECONDS = click.FloatRange(min=0, min_open=True)


class TellAbout:
    """Prints the events of some tasks; an `on_report` for `HiveClient`."""

    def __init__(self) -> None:
        self.ids: set[str] = set()

    def __call__(self, _report: Report | None, events: Sequence[Event]) -> None:
        """Print those of some events that are about these tasks."""
        for event in events:
            if event.task_id in self.ids:
                click.echo(event.text, err=True)


@click.command(no_args_is_help=True)
@click.argument("kind", metavar="TYPE", type=click.Choice(_TYPE_NAMES, case_sensitive=False))
@click.option(
    "--goal",
    "goals",
    type=GoalParam(),
    multiple=True,
    required=True,
    help="A goal: x,y in the map frame [m] or a place by name, and if you like a heading behind "
    "it [°]. Repeat it for A, B, C ... in this order.",
)
@click.option(
    "--priority",
    type=click.IntRange(0, MAX_PRIORITY),
    default=0,
    show_default=True,
    help="10 is the highest.",
)
@click.option(
    "--payload",
    type=click.FloatRange(min=0),
    default=0.0,
    show_default=True,
    help="Mass of the load [kg].",
)
@click.option(
    "--no-split",
    is_flag=True,
    help="Never split the task: it waits until one robot can carry all of the load.",
)
@click.option("--id", "task_id", help="The id of the task; the next of T1, T2, ... by default.")
@click.option("--wait", is_flag=True, help="Follow the task until it has ended.")
@click.option("--timeout", type=SECONDS, help="With --wait: give up after this many seconds.")
@pass_context
def add(
    context: CliContext,
    kind: str,
    goals: tuple[Goal, ...],
    priority: int,
    payload: float,
    no_split: bool,
    task_id: str | None,
    wait: bool,
    timeout: float | None,
) -> None:
    """Post a task and print its id.

    TYPE is what a robot does: GA goes to A, GAB goes to A and then to B (and C ...), GPA goes to A
    and picks there, GPAB picks at A, brings the load to B and puts it down there.

    \b
    Examples:
      hive add GA --goal 3,4
      hive add GAB --goal 3,4 --goal 8,2,90 --priority 5 --payload 20
      hive add GPAB --goal 'test cell' --goal 8,2 --payload 0.4 --wait

    A load that is too heavy for every robot in service is split into parts, unless --no-split is
    given; a line on stderr says so beforehand.

    Exits with 0 when the task is on the list (with --wait: when it is DONE), with 1 when it was
    rejected, was cancelled or has failed.
    """  # noqa: D301  (to click, \b means: keep the lines)
    task_type = TaskType[kind.upper()]
    if len(goals) < task_type.goals_needed:
        needs = f"{task_type.name} needs --goal at least {task_type.goals_needed} times"
        raise click.UsageError(f"{needs}, not {len(goals)}")
    if timeout is not None and not wait:
        raise click.UsageError("--timeout needs --wait")
    tell = TellAbout()
    with context.connect(()) as link:
        client = HiveClient(link, tell)
        places = link.places() if any(goal.name for goal in goals) else {}
        poses = tuple(goal.pose(places) for goal in goals)
        task = Task(task_id or "", task_type, poses, priority, payload, no_split=no_split)
        if task.payload and client.hear_robots():
            tell_outlook(task, client)
        answer = client.submit(task) if task_id else client.submit_numbered(task)
        name = id_of(answer)
        if answer.state is TaskState.REJECTED:
            raise NotDoneError(f"task {name} was rejected: {answer.reason}")
        click.echo(name)
        if wait:
            tell.ids.add(name)
            demand_done(client.follow([name], timeout), client)


@click.command()
@click.argument("task_id", metavar="ID", type=OPEN_TASK_ID)
@yes_option
@pass_context
def cancel(context: CliContext, task_id: str, yes: bool) -> None:
    """Cancel the task ID.

    Where a robot carries the load of the task, it says first what becomes of it.

    Exits with 0 when the task is cancelled, with 1 when there is no such task or it has ended.
    """
    with context.connect(()) as link:
        client = HiveClient(link)
        client.fetch_tasks()
        known = client.state.record(task_id)
        if known is not None:
            parts = unfinished_parts(known, client.state.records)
            ask_first(consequences.of_cancelling([known, *parts]), yes=yes)
        client.cancel(task_id)
    click.echo(f"task {task_id} is cancelled", err=True)


def tell_outlook(task: Task, client: HiveClient) -> None:
    """Say before a task is posted that it will be split, or will wait, because it is too heavy."""
    robots = (row.status for row in client.state.robots.values())
    if words := outlook(task, robots):
        click.echo(words, err=True)


def demand_done(states: Mapping[str, TaskState], client: HiveClient) -> None:
    """Fail where a task ended in another state than DONE, and say why."""
    others = []
    for task_id, state in states.items():
        if state is not TaskState.DONE:
            known = client.state.last_word(task_id)
            because = f" ({known.reason})" if known and known.reason else ""
            others.append(f"{task_id} {state.name}{because}")
    if others:
        raise NotDoneError(f"{len(others)} of {len(states)} not done: {'; '.join(others)}")
