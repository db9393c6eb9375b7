# SPDX-License-Identifier: BSD-3-Clause
"""What the commands need from outside, handed to them by whoever runs the command line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fleet_manager.client.client import HiveClient
from fleet_manager.client.words import changes
from hive_common.resources import names_in

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from contextlib import AbstractContextManager

    from click.shell_completion import CompletionItem

    from blackboard.domain.record import TaskRecord
    from fleet_manager.client.client import Link
    from fleet_manager.client.hive_view import HiveView, Report


@dataclass(frozen=True)
class Outside:
    """The world outside the command line.

    Attributes:
        connect: Opens a link to the hive of ROS_MASTER_URI that also hands over what the demo
            records of the robots named, none for most commands. Raises NoHiveError where no ROS
            master answers.
        journals: Names the folder in which the members of that hive keep their journals, unless a
            parameter names another.
    """

    connect: Callable[[Sequence[str]], AbstractContextManager[Link]]
    journals: Callable[[], Path] = Path


pass_outside = click.make_pass_decorator(Outside)


def tell_changes(view: HiveView, report: Report) -> None:
    """Print a line for each change; an `on_report` for `HiveClient`."""
    for sentence in changes(view, report):
        click.echo(sentence, err=True)


class TellAbout:
    """Prints the changes of some tasks only; an `on_report` for `HiveClient`.

    Attributes:
        ids: The tasks that are told about; may grow.
    """

    def __init__(self) -> None:
        self.ids: set[str] = set()

    def __call__(self, view: HiveView, report: Report) -> None:
        """Print a line for each change of one of the tasks."""
        for sentence in changes(view, report):
            if any(f"task {task_id} " in sentence for task_id in self.ids):
                click.echo(sentence, err=True)


def quiet_client(link: Link) -> HiveClient:
    """Return a client that prints nothing by itself."""
    return HiveClient(link)


class FileName(click.ParamType):
    """The name of a file that comes with a package, or a path; completed by name."""

    name = "name"

    def __init__(self, package: str, folder: str) -> None:
        self._package = package
        self._folder = folder

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Return the names that begin with what was typed."""
        names = names_in(self._package, self._folder)
        return click.Choice(names).shell_complete(ctx, param, incomplete)


def open_tasks(view: HiveView, *, everything: bool) -> list[TaskRecord]:
    """Return the tasks that have not ended, or all of them, in the order they were posted."""
    return [r for r in view.tasks.values() if everything or not r.state.is_terminal]
