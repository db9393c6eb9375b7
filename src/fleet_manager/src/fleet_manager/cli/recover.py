# SPDX-License-Identifier: BSD-3-Clause
"""The command for a hive that does not start because of what is on its disks: `recover`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from blackboard.auction.decision_log import ENDING
from blackboard.consensus.journal import drop_task
from fleet_manager.cli.context import journal_option, pass_context
from fleet_manager.errors import NotDoneError

if TYPE_CHECKING:
    from pathlib import Path

    from fleet_manager.cli.context import CliContext


@click.command()
@click.option(
    "--drop",
    "task",
    required=True,
    metavar="TASK",
    help="The id of the task to remove from the list of every member on this machine.",
)
@journal_option
@pass_context
def recover(context: CliContext, task: str, folder: Path | None) -> None:
    """Remove a task from the disks of a hive that does not start because of it.

    End all members before, and run this on every machine that has members, before you start any of
    them again: their lists must be the same. A hive that runs removes a task with `hive cancel`.

    \b
    Examples:
      hive recover --drop T7
    """  # noqa: D301  (to click, \b means: keep the lines)
    where = folder or context.journals()
    journals = [path for path in sorted(where.glob("*.sqlite3")) if not path.name.endswith(ENDING)]
    dropped = [path.stem for path in journals if drop_task(path, task)]
    if not dropped:
        raise NotDoneError(
            f"no journal in {where} has {task}; name another folder with --journal, or run this "
            "on the machine of the member that named the task"
        )
    click.echo(f"{task} is removed from the journals of {', '.join(dropped)} in {where}")
