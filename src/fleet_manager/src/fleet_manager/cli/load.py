# SPDX-License-Identifier: BSD-3-Clause
"""The command `load`: posts random tasks to a live hive."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from fleet_manager.cli.context import FileName, pass_context
from fleet_manager.cli.scenarios import post_scenario
from fleet_manager.config.load import Load
from hive_common.map_file import load_map
from hive_common.structuring import structure

if TYPE_CHECKING:
    from fleet_manager.cli.context import CliContext


@click.command()
@click.option("--at-once", type=click.IntRange(0, 1000), default=0, help="Tasks at the start.")
@click.option(
    "--per-hour", type=click.FloatRange(0, 3600), default=0.0, help="Mean rate of tasks [1/h]."
)
@click.option(
    "--minutes",
    type=click.FloatRange(0),
    default=10.0,
    show_default=True,
    help="How long tasks are posted, by the hive's clock.",
)
@click.option(
    "--mix",
    default="GA=1,GAB=1,GPA=1,GPAB=1",
    show_default=True,
    help="How frequent each task type is.",
)
@click.option(
    "--map",
    "chart",
    type=FileName("simenv", "maps"),
    default="lab",
    show_default=True,
    help="The hive's map: name or path; goals are on its free floor.",
)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Of the draw.")
@click.option("--wait", is_flag=True, help="Follow the tasks until the last one has ended.")
@pass_context
def load(
    context: CliContext,
    at_once: int,
    per_hour: float,
    minutes: float,
    mix: str,
    chart: str,
    seed: int,
    wait: bool,
) -> None:
    """Post random tasks to the hive, at random times.

    The same options draw the same tasks again; a second run gives them new ids.

    \b
    Examples:
      hive load --at-once 12 --wait
      hive load --per-hour 240 --minutes 30 --mix GA=1,GAB=3 --seed 7

    Exits with 0 when every task is on the list (with --wait: when every task is DONE).
    """  # noqa: D301  (to click, \b means: keep the lines)
    given = {
        "at_once": at_once, "per_hour": per_hour, "minutes": minutes, "mix": parsed_mix(mix)
    }  # fmt: skip
    drawn = structure(given, Load)
    tasks = drawn.draw(load_map(chart), seed)
    scenario = drawn.scenario(world="", chart=chart, fleet="", tasks=tasks, limit=86400.0)
    post_scenario(context, scenario, wait=wait, timeout=None)


def parsed_mix(text: str) -> dict[str, float]:
    """Return the weight of each task type of a text such as `GA=1,GAB=2`."""
    mix: dict[str, float] = {}
    for part in text.split(","):
        name, _, weight = part.partition("=")
        try:
            mix[name.strip().upper()] = float(weight)
        except ValueError:
            raise click.UsageError(
                f"--mix {text}: {part!r} is not TYPE=WEIGHT; an example is GA=1,GAB=2"
            ) from None
    return mix
