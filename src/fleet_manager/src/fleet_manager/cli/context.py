# SPDX-License-Identifier: BSD-3-Clause
"""What the commands share: the context that they run in, and file names as arguments."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hive_common.resources import names_in

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from contextlib import AbstractContextManager

    from click.shell_completion import CompletionItem

    from fleet_manager.client.client import ClientLink


@dataclass(frozen=True)
class CliContext:
    """The ports that the command line is given.

    Attributes:
        connect: Opens a link to the hive of ROS_MASTER_URI. The link also reports the ground truth
            and the batteries of the robots named; most commands name none. Raises NoHiveError
            where no ROS master answers.
        journals: Returns the default folder of that hive's journals.
    """

    connect: Callable[[Sequence[str]], AbstractContextManager[ClientLink]]
    journals: Callable[[], Path] = Path


pass_context = click.make_pass_decorator(CliContext)


class FileName(click.ParamType):
    """The name of a file that comes with a package, or a path; completed by name."""

    name = "name"

    def __init__(self, package: str, folder: str) -> None:
        self._package = package
        self._folder = folder

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Return the names that begin with the typed text."""
        names = names_in(self._package, self._folder)
        return click.Choice(names).shell_complete(ctx, param, incomplete)
