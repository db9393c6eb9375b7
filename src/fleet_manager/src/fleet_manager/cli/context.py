# SPDX-License-Identifier: BSD-3-Clause
"""What the commands share: the context that they run in, and arguments with tab completion."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import click

from fleet_manager.client.client import HiveClient
from fleet_manager.errors import InputError
from hive_common.errors import HiveError
from hive_common.resources import names_in

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from contextlib import AbstractContextManager

    from click.shell_completion import CompletionItem

    from fleet_manager.client.client import ClientLink
    from simenv.faults import Fault


class FaultLink(Protocol):
    """Makes something go wrong; every call returns a report.

    They raise InputError where that cannot be done, and NoHiveError where no ROS master answers.
    """

    def inject(self, fault: Fault) -> str:
        """Have the simulator inject a fault."""

    def drop_charge(self, robot: str, level: float) -> str:
        """Let a robot's battery drop to a level from 0 to 1."""

    def vanish(self, robot: str, *, back: bool) -> str:
        """Stop all processes of a robot, or let them go on."""

    def kill_leader(self) -> str:
        """Kill the process of the leader."""


def _no_faults() -> FaultLink:
    raise InputError("faults are injected on ROS; run `hive fault`")


def _nowhere_else(_ends: Sequence[str], _certificates: str) -> CliContext:
    raise InputError("--connect is for a hive over Zenoh; run `hive`")


@dataclass(frozen=True)
class CliContext:
    """The ports that the command line is given.

    Attributes:
        connect: Opens a link to the hive of ROS_MASTER_URI. The link also reports the ground truth
            and the batteries of the robots named; most commands name none. Raises NoHiveError
            where no ROS master answers.
        journals: Returns the default folder of that hive's journals.
        faults: Opens what injects faults into that hive.
        elsewhere: Returns the context of a hive over Zenoh; see
            `config.zenoh_operator.operator_site`.
    """

    connect: Callable[[Sequence[str]], AbstractContextManager[ClientLink]]
    journals: Callable[[], Path] = Path
    faults: Callable[[], FaultLink] = _no_faults
    elsewhere: Callable[[Sequence[str], str], CliContext] = _nowhere_else


def context_of(ctx: click.Context) -> CliContext | None:
    """Return the ports of a command line, as its option --connect says; None where it has none."""
    context = ctx.find_object(CliContext)
    given = ctx.find_root().params
    if context is not None and given.get("connect"):
        return context.elsewhere(given["connect"], given["certificates"])
    return context


pass_context = click.make_pass_decorator(CliContext)

journal_option = click.option(
    "--journal",
    "folder",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="The folder of the journals, where the parameter journal names another.",
)


yes_option = click.option("--yes", is_flag=True, help="Do not ask, whatever it brings with it.")


def ask_first(consequences: Sequence[str], *, yes: bool) -> None:
    """Say what a request brings with it, and ask whether to go on where a person can answer.

    Raises:
        click.Abort: The answer is no.
    """
    for each in consequences:
        click.echo(each, err=True)
    if consequences and not yes and click.get_text_stream("stdin").isatty():
        click.confirm("Go on?", abort=True, err=True)


class FileName(click.ParamType):
    """The name of a file that comes with a package, or a path; completed by name."""

    name = "name"

    def __init__(self, package: str, folder: str) -> None:
        self.found_in = package, folder

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Return the names that begin with the typed text."""
        names = names_in(*self.found_in)
        return click.Choice(names).shell_complete(ctx, param, incomplete)


def new_folder(results: Path, name: str) -> Path:
    """Make and return a folder of a run's own, even if another started in the same second.

    Args:
        results: The folder in which it is made.
        name: What runs; the folder's name has the date and the time too.

    Raises:
        click.UsageError: It cannot be made.
    """
    stem = f"{name}-{datetime.now().astimezone():%Y%m%d-%H%M%S}"
    for ending in ("", *(f"-{number}" for number in range(2, 100))):
        folder = results / f"{stem}{ending}"
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            continue
        except OSError as error:
            raise click.UsageError(f"{folder} cannot be made: {error.strerror}") from None
        return folder
    raise click.UsageError(f"{results} has 99 runs of this second; choose another --results")


class _OfHive(click.ParamType):
    """A name that the running hive knows; nothing is completed where no hive answers."""

    def __init__(self, name: str, ask: Callable[[HiveClient], Iterable[str]]) -> None:
        self.name = name
        self._ask = ask

    def shell_complete(
        self,
        ctx: click.Context,
        param: click.Parameter,
        incomplete: str,
    ) -> list[CompletionItem]:
        """Return the names that begin with the typed text."""
        names = list[str]()
        with contextlib.suppress(HiveError):
            if (context := context_of(ctx)) is not None:
                with context.connect(()) as link:
                    names += self._ask(HiveClient(link))
        return click.Choice(names).shell_complete(ctx, param, incomplete)


def _tasks(client: HiveClient) -> Iterable[str]:
    client.fetch_tasks(within=1.0)
    return client.state.records


def _open_tasks(client: HiveClient) -> Iterable[str]:
    return [name for name in _tasks(client) if client.state.tasks[name].is_open]


def _robots(client: HiveClient) -> Iterable[str]:
    client.fetch_robots()
    return sorted(client.state.robots)


def _zones(client: HiveClient) -> Iterable[str]:
    return client.fetch_traffic().zones


TASK_ID = _OfHive("text", _tasks)
OPEN_TASK_ID = _OfHive("text", _open_tasks)
ROBOT_NAME = _OfHive("text", _robots)
PLACE_NAME = _OfHive("text", lambda client: client.link.places())
ZONE_NAME = _OfHive("text", _zones)
