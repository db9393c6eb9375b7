# SPDX-License-Identifier: BSD-3-Clause
"""The command `fault`: injects faults, to see how the hive copes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from fleet_manager.cli.context import ROBOT_NAME, pass_context
from simenv.faults import Fault

if TYPE_CHECKING:
    from fleet_manager.cli.context import CliContext

_OFF = click.option("--off", is_flag=True, help="End it.")


@click.group()
def fault() -> None:
    """Inject faults, to see how the hive copes.

    \b
    Examples:
      hive fault freeze robot1
      hive fault freeze robot1 --off
      hive fault block box --area 9.5,2.6,10.5,3.8
      hive fault kill-leader
    """  # noqa: D301  (to click, \b means: keep the lines)


@fault.command()
@click.argument("robot", type=ROBOT_NAME)
@_OFF
@pass_context
def freeze(context: CliContext, robot: str, off: bool) -> None:
    """Stop ROBOT's base; it ignores commands."""
    _inject(context, Fault("freeze", robot, float(not off)))


@fault.command()
@click.argument("robot", type=ROBOT_NAME)
@click.argument("share", type=click.FloatRange(0, 1), default=0.5)
@pass_context
def slip(context: CliContext, robot: str, share: float) -> None:
    """Let ROBOT's wheels slip for SHARE (0..1) of the way; 0 ends it."""
    _inject(context, Fault("slip", robot, share))


@fault.command()
@click.argument("robot", type=ROBOT_NAME)
@_OFF
@pass_context
def blind(context: CliContext, robot: str, off: bool) -> None:
    """Cover ROBOT's laser."""
    _inject(context, Fault("blind", robot, float(not off)))


@fault.command()
@click.argument("robot", type=ROBOT_NAME)
@click.argument("grips", type=click.IntRange(0), default=1)
@pass_context
def pick(context: CliContext, robot: str, grips: int) -> None:
    """Let the next GRIPS of ROBOT's arm fail."""
    _inject(context, Fault("pick", robot, float(grips)))


@fault.command()
@click.argument("name")
@click.option("--area", help="x_min,y_min,x_max,y_max in the map frame [m].")
@_OFF
@pass_context
def block(context: CliContext, name: str, area: str | None, off: bool) -> None:
    """Put an obstacle called NAME in the way, or remove it."""
    if (area is None) is not off:
        raise click.UsageError("give --area to add an obstacle, or --off to remove it")
    _inject(context, Fault("block", name, float(not off), _numbers(area) if area else ()))


@fault.command()
@click.argument("robot", type=ROBOT_NAME)
@click.argument("level", type=click.FloatRange(0, 1))
@pass_context
def battery(context: CliContext, robot: str, level: float) -> None:
    """Let ROBOT's battery drop to LEVEL (0..1); a lower charge stays."""
    click.echo(context.faults().drop_charge(robot, level))


@fault.command()
@click.argument("robot", type=ROBOT_NAME)
@_OFF
@pass_context
def vanish(context: CliContext, robot: str, off: bool) -> None:
    """Stop all of ROBOT's processes on this machine, or let them go on.

    To the others it looks like a lost network: nothing is closed, and nothing answers.
    """
    click.echo(context.faults().vanish(robot, back=off))


@fault.command("kill-leader")
@pass_context
def kill_leader(context: CliContext) -> None:
    """Kill the process of the leader on this machine; another member takes over."""
    click.echo(context.faults().kill_leader())


def _inject(context: CliContext, what: Fault) -> None:
    click.echo(context.faults().inject(what))


def _numbers(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise click.UsageError(
            f"--area {text}: needs four numbers with commas between, such as 9.5,2.6,10.5,3.8"
        ) from None
