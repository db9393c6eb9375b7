# SPDX-License-Identifier: BSD-3-Clause
"""The commands that explain why a task went to a robot: `why`, `replay`.

They read the decisions that members of the hive recorded on this machine, so they also work after
the hive has ended.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING

import click

from blackboard.auction.decision import replayed
from blackboard.auction.decision_log import read_decisions
from blackboard.costing.cost import COST_MODELS
from fleet_manager.cli.context import TASK_ID, journal_option, pass_context
from fleet_manager.client import tables
from fleet_manager.errors import NotDoneError

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from blackboard.auction.decision import Decision
    from fleet_manager.cli.context import CliContext


@click.command()
@click.argument("task", type=TASK_ID)
@journal_option
@click.option("--all", "everything", is_flag=True, help="Show earlier decisions as well.")
@click.option("--json", "as_json", is_flag=True, help="Print a JSON list instead of tables.")
@pass_context
def why(
    context: CliContext, task: str, folder: Path | None, everything: bool, as_json: bool
) -> None:
    """Explain why TASK went to a robot, or why no robot can take it: all bids with their terms.

    For a task that was split, it tells why, and which robot got which part.

    \b
    Examples:
      hive why T7
      hive why T7 --all --json
    """  # noqa: D301  (to click, \b means: keep the lines)
    decisions = _decisions(context.journals, task, folder)
    shown = decisions if everything else decisions[-1:]
    if as_json:
        click.echo(json.dumps([asdict(each) for each in shown], indent=2))
        return
    for decision in shown:
        click.echo(tables.decided(decision))
        if decision.bids:
            click.echo("\n".join(tables.bids_table(decision.bids)))
        if decision.parts:
            where = folder or context.journals()
            last = {part: _last_since(decision, part, where) for part in decision.parts}
            click.echo("\n".join(tables.parts_table(last)))
    if hidden := len(decisions) - len(shown):
        click.echo(f"{hidden} earlier: hive why {task} --all", err=True)


@click.command()
@click.argument("task", type=TASK_ID)
@click.option(
    "--model",
    type=click.Choice(sorted(COST_MODELS)),
    required=True,
    help="The cost model that computes the bids.",
)
@journal_option
@pass_context
def replay(context: CliContext, task: str, model: str, folder: Path | None) -> None:
    """Compute who would have got TASK by another cost model.

    The queues of the robots, and the places in them that were bid for, stay as they were.

    \b
    Examples:
      hive replay T7 --model latency
    """  # noqa: D301  (to click, \b means: keep the lines)
    decision = _decisions(context.journals, task, folder)[-1]
    bids = replayed(decision, model)
    able = [bid.robot_id for bid in bids if bid.is_able]
    then = able[0] if able else "nobody"
    now = decision.winner or "nobody"
    changed = f"{then} instead of {now}" if then != now else f"{now} all the same"
    click.echo(f"{task} by {model}: {changed}")
    if decision.winner and decision.reason:
        click.echo(f"it did not go to the lowest bid: {decision.reason}")
    click.echo("\n".join(tables.bids_table(bids)))


def _last_since(split: Decision, part: str, where: Path) -> Decision:
    """Return the last decision on a part of a task since it was split; the split if there is none.

    An earlier split of the task may have had a part of the same id.
    """
    later = [each for each in read_decisions(where, part) if each.number >= split.number]
    return later[-1] if later else split


def _decisions(journals: Callable[[], Path], task: str, folder: Path | None) -> list[Decision]:
    """Return the decisions on a task, oldest first; raise NotDoneError where none is recorded."""
    where = folder or journals()
    decisions = read_decisions(where, task)
    if not decisions:
        raise NotDoneError(
            f"nothing is recorded about {task} in {where}; name another folder with --journal"
        )
    return decisions
