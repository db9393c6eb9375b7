# SPDX-License-Identifier: BSD-3-Clause
"""The command `run`, which posts a scenario, and the same for scenarios that are not in a file."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from blackboard.domain.task import TaskState
from fleet_manager.cli.context import FileName, pass_context
from fleet_manager.cli.tasks import SECONDS, TellAbout, demand_done, tell_outlook
from fleet_manager.client.client import Feeder, HiveClient
from fleet_manager.config.scenario import read_scenario, with_free_ids
from fleet_manager.errors import NotDoneError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.domain.task import Task
    from fleet_manager.cli.context import CliContext
    from fleet_manager.config.scenario import Scenario


@click.command()
@click.argument("scenario", type=FileName("fleet_manager", "scenarios"))
@click.option("--wait", is_flag=True, help="Follow the tasks until the last one has ended.")
@click.option(
    "--timeout", type=SECONDS, help="With --wait: give up this many seconds after the last task."
)
@pass_context
def run(context: CliContext, scenario: str, wait: bool, timeout: float | None) -> None:
    """Post the tasks of a SCENARIO at the times it states, by the hive's clock.

    SCENARIO is the name of a file that comes with fleet_manager, or the path of another. A second
    run gives the tasks new ids.

    \b
    Examples:
      hive run smoke --wait
      hive run ./my_tasks.yaml

    Exits with 0 when every task is on the list (with --wait: when every task is DONE).
    """  # noqa: D301  (to click, \b means: keep the lines)
    post_scenario(context, read_scenario(scenario), wait=wait, timeout=timeout)


def post_scenario(
    context: CliContext, scenario: Scenario, *, wait: bool, timeout: float | None
) -> None:
    """Post the tasks of a scenario at its times, under ids that no known task has.

    Args:
        context: Where the hive is.
        scenario: What is posted.
        wait: Whether to follow the tasks until the last one has ended.
        timeout: With `wait`: the time after the last posting [s]; None for as long as it takes.

    Raises:
        NotDoneError: The hive rejected a task; with `wait`: a task was not done.
    """
    tell = TellAbout()
    with context.connect(()) as link:
        client = HiveClient(link, tell)
        client.fetch_tasks()
        plan = with_free_ids(scenario, client.state.records)
        is_heavy = any(planned.task.payload for planned in plan.tasks)
        knows_robots = is_heavy and client.hear_robots()

        def before(task: Task) -> None:
            if knows_robots:
                tell_outlook(task, client)

        feeder = Feeder(client, plan.tasks, before)
        while not feeder.done:
            for task_id, answer in feeder.post_due().items():
                tell.ids.add(task_id)
                because = f": {answer.reason}" if answer.reason else ""
                click.echo(f"{task_id} {answer.state.name}{because}")
            client.pump(lambda: False, feeder.next_in(most=0.5))
        ids = [planned.task.id for planned in plan.tasks]
        states = client.follow(ids, timeout) if wait else feeder.states
        demand_done(states, client) if wait else _demand_taken_in(states)


def _demand_taken_in(states: Mapping[str, TaskState]) -> None:
    """Fail where a task of a scenario was rejected; each was reported already."""
    rejected = [task_id for task_id, state in states.items() if state is TaskState.REJECTED]
    if rejected:
        raise NotDoneError(f"{len(rejected)} of {len(states)} rejected: {', '.join(rejected)}")
