# SPDX-License-Identifier: BSD-3-Clause
"""The `hive` command: all its commands, and its exit codes, on which scripts rely.

A command's module is imported when the command is used: some need much that others do not.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from fleet_manager.cli.context import context_of
from fleet_manager.errors import FleetManagerError
from hive_common.errors import HiveError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fleet_manager.cli.context import CliContext

EXIT_CODES = """\b
Exit codes:
  0    success
  1    the hive answered, and the answer is no: rejected, failed, cancelled, no such task
  2    an argument or a file cannot be used
  3    no ROS master or no blackboard answers
  4    not done within the timeout
  5    the hive did not start
  130  ended by Ctrl-C (143: by SIGTERM)"""

_MODULES = MappingProxyType(
    {
        "add": "tasks",
        "cancel": "tasks",
        "run": "scenarios",
        "tasks": "watch",
        "robots": "watch",
        "robot": "robot",
        "watch": "watch",
        "events": "watch",
        "traffic": "traffic",
        "zone": "traffic",
        "why": "why",
        "replay": "why",
        "recover": "recover",
        "demo": "demo",
        "bench": "bench",
        "compare": "bench",
        "load": "load",
        "world": "world",
        "map": "map",
        "certs": "certs",
        "router": "router",
        "learned": "learned",
        "fault": "fault",
    }
)
"""Which module of this package holds each command."""

_OVER_ZENOH = frozenset({
    "add", "cancel", "events", "load", "robot", "robots", "run", "tasks", "traffic", "watch",
    "zone",
})  # fmt: skip
"""Commands that need nothing but what the hive says on its topics."""

_BUILT_IN = {"map"}
"""Commands whose functions are called otherwise, because Python has one of that name."""

_BAD_INPUT = 2
_CTRL_C = 130

_HELP = f"""Give tasks to a hive of robots and follow them.

Talks to the hive whose ROS master is at ROS_MASTER_URI, or, with --connect, to a
hive over Zenoh, without a ROS master. Headings are in degrees, counter-clockwise.

\b
Examples:
  hive demo
  hive add GAB --goal 3,4 --goal 8,2 --priority 5 --payload 20
  hive watch
  hive why T7
  hive --connect /etc/robo-hive/fleet.yaml tasks

{EXIT_CODES}

Tab completion in bash: eval "$(_HIVE_COMPLETE=bash_source hive)"
"""


class _Commands(click.Group):
    """Commands that are imported on demand."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002  (click's interface)
        """Return the names of all commands, sorted."""
        return sorted(_MODULES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002  (click's interface)
        """Return a command; None if there is none of that name."""
        if cmd_name not in _MODULES:
            return None
        module = import_module(f"fleet_manager.cli.{_MODULES[cmd_name]}")
        name = f"{cmd_name}_" if cmd_name in _BUILT_IN else cmd_name
        command: click.Command = getattr(module, name)
        return command


@click.group(cls=_Commands, help=_HELP, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--connect",
    multiple=True,
    metavar="WHERE",
    envvar="HIVE_CONNECT",
    help="A hive over Zenoh: its fleet file, or tls/HOST:PORT of each member or of a router.",
)
@click.option(
    "--certificates",
    default="",
    metavar="DIR",
    envvar="HIVE_CERTIFICATES",
    help="With --connect: the folder of your certificate, if the fleet file does not say it.",
)
@click.pass_context
def hive(ctx: click.Context, connect: Sequence[str], certificates: str) -> None:
    """Group the commands; the help text is `_HELP`."""
    if not connect:
        if certificates and _is_typed(ctx, "certificates"):
            raise click.UsageError("--certificates needs --connect")
        return
    if ctx.invoked_subcommand in _OVER_ZENOH:
        ctx.obj = context_of(ctx)
    elif _is_typed(ctx, "connect"):
        allowed = ", ".join(sorted(_OVER_ZENOH))
        raise click.UsageError(
            f"{ctx.invoked_subcommand} works on this machine; --connect is allowed with {allowed}"
        )


def _is_typed(ctx: click.Context, option: str) -> bool:
    """Return whether an option was typed; one of the environment is for whom it concerns."""
    return ctx.get_parameter_source(option) is ParameterSource.COMMANDLINE


def run(
    context: CliContext, arguments: Sequence[str] | None = None, command: click.Command = hive
) -> int:
    """Run the command line once and return its exit code; an error is one line on stderr.

    Without `arguments` it takes the words of this process. The benchmarks of `hive_lab` pass a
    `command` of their own and exit by the same rules.
    """
    words = sys.argv[1:] if arguments is None else list(arguments)
    for word in words:
        if not _is_text(word):
            click.echo(f"hive: {word!a} is not a text in UTF-8; type it again", err=True)
            return _BAD_INPUT
    try:
        result = command.main(words, prog_name="hive", obj=context, standalone_mode=False)
    except click.ClickException as error:
        click.echo(f"hive: {_one_line(error)}", err=True)
        return _BAD_INPUT
    except (click.Abort, KeyboardInterrupt):
        return _CTRL_C
    except HiveError as error:
        click.echo(f"hive: {error}", err=True)
        return error.exit_code if isinstance(error, FleetManagerError) else _BAD_INPUT
    except BrokenPipeError:
        sys.stderr.close()
        return 0
    return result if isinstance(result, int) else 0


def _is_text(word: str) -> bool:
    """Return whether a word can be printed; bytes that are not UTF-8 arrive as surrogates."""
    try:
        word.encode()
    except UnicodeEncodeError:
        return False
    return True


def _one_line(error: click.ClickException) -> str:
    """Return what is wrong with the command line, and how to get help."""
    context = error.ctx if isinstance(error, click.UsageError) else None
    command = context.command_path if context else "hive"
    return f"{error.format_message().rstrip('.')}; see `{command} --help`"
