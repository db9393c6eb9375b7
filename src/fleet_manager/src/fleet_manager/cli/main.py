# SPDX-License-Identifier: BSD-3-Clause
"""The `hive` command: the commands put together, and how it ends.

Exit codes are a promise to scripts; `EXIT_CODES` is the one list of them.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from fleet_manager.cli import asking, bench, demo, fault, looking, why, world
from fleet_manager.errors import FleetManagerError
from hive_common.errors import HiveError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fleet_manager.cli.outside import Outside

EXIT_CODES = """\b
Exit codes:
  0    what was asked for is done
  1    the hive answered, and the answer is no: rejected, failed, cancelled, no such task
  2    an argument or a file cannot be used
  3    no ROS master or no blackboard answers
  4    not done within the time that was allowed
  5    a hive that was to be started did not come up
  130  ended by Ctrl-C (143: by SIGTERM)"""

_BAD_INPUT = 2
_CTRL_C = 130

_HELP = f"""Give tasks to a hive of robots and see what becomes of them.

Talks to the hive whose ROS master is at ROS_MASTER_URI. A yaw is in radians, counter-clockwise.

\b
Examples:
  hive demo
  hive add GAB --goal 3,4 --goal 8,2 --priority 5 --payload 20
  hive watch
  hive why T7

{EXIT_CODES}

Tab completion in bash: eval "$(_HIVE_COMPLETE=bash_source hive)"
"""


@click.group(help=_HELP, context_settings={"help_option_names": ["-h", "--help"]})
def hive() -> None:
    """Hold the commands; the help text is `_HELP`."""


for _command in (
    asking.add, asking.cancel, asking.run, looking.tasks, looking.robots, looking.watch,
    looking.events, why.why, why.replay, demo.demo, bench.bench, world.world, fault.fault,
):  # fmt: skip
    hive.add_command(_command)


def run(
    outside: Outside, arguments: Sequence[str] | None = None, command: click.Command = hive
) -> int:
    """Run the command line once.

    Args:
        outside: What the commands need from outside.
        arguments: The words behind `hive`; those of this process where None.
        command: Which command is run; the benchmarks of `hive_lab` end by the same rules.

    Returns:
        The exit code; what went wrong has been said on stderr, in one line.
    """
    try:
        result = command.main(arguments, prog_name="hive", obj=outside, standalone_mode=False)
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


def _one_line(error: click.ClickException) -> str:
    """Return what is wrong with the command line, and where its help is."""
    context = error.ctx if isinstance(error, click.UsageError) else None
    command = context.command_path if context else "hive"
    return f"{error.format_message().rstrip('.')}; see `{command} --help`"
