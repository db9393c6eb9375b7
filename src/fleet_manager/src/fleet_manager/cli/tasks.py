# SPDX-License-Identifier: BSD-3-Clause
"""The commands that ask the hive for something: `add`, `cancel`, `run`."""

from __future__ import annotations

import math
import secrets
from typing import TYPE_CHECKING

import click

from blackboard.domain.task import MAX_PRIORITY, Task, TaskState, TaskType
from fleet_manager.cli.outside import FileName, TellAbout, pass_outside
from fleet_manager.client.client import HiveClient
from fleet_manager.client.feeder import Feeder
from fleet_manager.config.scenario import read_scenario, with_free_ids
from fleet_manager.errors import NotDoneError
from hive_common.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fleet_manager.cli.outside import Outside

_TYPE_NAMES = [kind.name for kind in TaskType]


class GoalParam(click.ParamType):
    """A goal typed as `x,y` or `x,y,yaw` in m, m and rad."""

    name = "x,y[,yaw]"

    def convert(
        self,
        value: object,
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> Pose:
        """Return the pose, or fail with what is allowed."""
        if isinstance(value, Pose):
            return value
        try:
            numbers = [float(part) for part in str(value).split(",")]
        except ValueError:
            numbers = []
        if len(numbers) not in {2, 3} or not all(map(math.isfinite, numbers)):
            self.fail(
                f"{value!r} is no goal; allowed: x,y or x,y,yaw [m,m,rad], as in 3,4,1.57",
                param,
                ctx,
            )
        return Pose(*numbers)


@click.command(no_args_is_help=True)
@click.argument("kind", metavar="TYPE", type=click.Choice(_TYPE_NAMES, case_sensitive=False))
@click.option(
    "--goal",
    "goals",
    type=GoalParam(),
    multiple=True,
    required=True,
    help="A goal in the map frame [m,m,rad]; give A, B, C ... in their order.",
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
    help="What is to be carried [kg].",
)
@click.option("--id", "task_id", help="A name of its own for the task; made up where not given.")
@click.option("--wait", is_flag=True, help="Follow the task until it has ended.")
@click.option(
    "--timeout",
    type=click.FloatRange(min=0, min_open=True),
    help="With --wait: give up after this many seconds.",
)
@pass_outside
def add(
    outside: Outside,
    kind: str,
    goals: tuple[Pose, ...],
    priority: int,
    payload: float,
    task_id: str | None,
    wait: bool,
    timeout: float | None,
) -> None:
    """Post a task and print its id.

    TYPE is what a robot does: GA goes to A, GAB goes to A and then to B (and C ...), GPA goes to A
    and picks there, GPAB picks at A, brings it to B and puts it down there.

    \b
    Examples:
      hive add GA --goal 3,4
      hive add GAB --goal 3,4 --goal 8,2,1.57 --priority 5 --payload 20
      hive add GPAB --goal 3,4 --goal 8,2 --payload 0.4 --wait

    Ends with 0 when the task is on the list (with --wait: when it is DONE), with 1 when it was
    rejected, cancelled or has failed.
    """  # noqa: D301  (to click, \b means: keep the lines)
    task_type = TaskType[kind.upper()]
    _demand_goals(task_type, len(goals))
    if timeout is not None and not wait:
        raise click.UsageError("--timeout has a meaning with --wait only")
    task = Task(task_id or f"T-{secrets.token_hex(3)}", task_type, goals, priority, payload)
    tell = TellAbout()
    with outside.connect(()) as link:
        client = HiveClient(link, tell)
        answer = client.submit(task)
        _refuse_rejected(task.id, answer.state, answer.reason)
        click.echo(task.id)
        if wait:
            tell.ids.add(task.id)
            _demand_done(client.follow([task.id], timeout), client)


@click.command()
@click.argument("task_id", metavar="ID")
@pass_outside
def cancel(outside: Outside, task_id: str) -> None:
    """Take the task ID off the list.

    Ends with 0 when it is cancelled, with 1 when there is no such task or it has ended already.
    """
    with outside.connect(()) as link:
        HiveClient(link).cancel(task_id)
    click.echo(f"task {task_id} is cancelled", err=True)


@click.command()
@click.argument("scenario", type=FileName("fleet_manager", "scenarios"))
@click.option("--wait", is_flag=True, help="Follow the tasks until the last one has ended.")
@click.option(
    "--timeout",
    type=click.FloatRange(min=0, min_open=True),
    help="With --wait: give up after this many seconds behind the last posting.",
)
@pass_outside
def run(outside: Outside, scenario: str, wait: bool, timeout: float | None) -> None:
    """Post the tasks of a SCENARIO at the times it states.

    SCENARIO is the name of a file that comes with fleet_manager, or the path of another. The times
    run on the hive's clock. A scenario can be run again: its tasks then get new ids.

    \b
    Examples:
      hive run smoke --wait
      hive run ./my_tasks.yaml

    Ends with 0 when every task is on the list (with --wait: when every one is DONE).
    """  # noqa: D301  (to click, \b means: keep the lines)
    read = read_scenario(scenario)
    tell = TellAbout()
    with outside.connect(()) as link:
        client = HiveClient(link, tell)
        client.fetch_tasks()
        plan = with_free_ids(read, client.view.tasks)
        feeder = Feeder(client, plan.tasks)
        while not feeder.done:
            for task_id, answer in feeder.post_due().items():
                tell.ids.add(task_id)
                because = f": {answer.reason}" if answer.reason else ""
                click.echo(f"{task_id} {answer.state.name}{because}")
            client.pump(lambda: False, feeder.next_in(most=0.5))
        ids = [planned.task.id for planned in plan.tasks]
        states = client.follow(ids, timeout) if wait else feeder.states
        _demand_done(states, client) if wait else _demand_taken_in(states)


def _demand_goals(kind: TaskType, given: int) -> None:
    if given < kind.goals_needed:
        raise click.UsageError(
            f"{kind.name} needs at least {kind.goals_needed} times --goal, not {given}"
        )


def _refuse_rejected(task_id: str, state: TaskState, reason: str) -> None:
    if state is TaskState.REJECTED:
        raise NotDoneError(f"task {task_id} was rejected: {reason}")


def _demand_taken_in(states: Mapping[str, TaskState]) -> None:
    """Fail where a task of a scenario was rejected; each has been said already."""
    rejected = [task_id for task_id, state in states.items() if state is TaskState.REJECTED]
    if rejected:
        raise NotDoneError(f"{len(rejected)} of {len(states)} rejected: {', '.join(rejected)}")


def _demand_done(states: Mapping[str, TaskState], client: HiveClient) -> None:
    """Fail where a task ended in anything but DONE, and say why."""
    others = []
    for task_id, state in states.items():
        if state is not TaskState.DONE:
            known = client.view.tasks.get(task_id) or client.view.answers.get(task_id)
            because = f" ({known.reason})" if known and known.reason else ""
            others.append(f"{task_id} {state.name}{because}")
    if others:
        raise NotDoneError(f"{len(others)} of {len(states)} not done: {'; '.join(others)}")
