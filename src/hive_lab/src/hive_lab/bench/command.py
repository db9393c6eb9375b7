# SPDX-License-Identifier: BSD-3-Clause
"""The command `bench`."""

from __future__ import annotations

import json
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fleet_manager.cli.context import pass_context
from fleet_manager.demo.machine import machine
from fleet_manager.ros import command_line
from hive_lab.bench.registry import BENCHES, BenchResult, as_json

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fleet_manager.cli.context import CliContext
    from hive_lab.bench.registry import Bench

LAYOUTS = 2000  # hard ones in which a fleet drives


@click.command()
@click.argument("name", required=False, type=click.Choice(sorted(BENCHES)))
@click.option(
    "--json",
    "file",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write the figures to a file as well.",
)
@click.option(
    "--runs",
    type=click.IntRange(min=1),
    metavar="N",
    help="How often, for architectures, cli, failover, flake, learning and traffic.",
)
@click.option(
    "--schedules",
    type=click.IntRange(min=1),
    metavar="N",
    help="How many are simulated, for faults; with --mutations, for each mutation at most.",
)
@click.option(
    "--mutations",
    is_flag=True,
    help="How many schedules it takes to notice each rule that is left out and each past mistake, "
    "for faults.",
)
@click.option(
    "--messages",
    type=click.IntRange(min=1),
    metavar="N",
    help="How many odd ones are delivered, for fuzz and fuzz-ros.",
)
@click.option(
    "--seed", type=click.IntRange(min=1), metavar="S", help="Of chance, for fuzz and fuzz-ros."
)
@click.option(
    "--minutes",
    type=click.IntRange(min=2),
    metavar="N",
    help="How long, for soak, traffic and vda5050.",
)
@click.option(
    "--robots",
    type=click.IntRange(min=2),
    metavar="N",
    help="How large a fleet, for architectures, auction, hive, scale, system, traffic and "
    "vda5050.",
)
@click.option(
    "--transport",
    type=click.Choice(["ros", "zenoh", "router"]),
    help="What carries the messages. For auction: ROS, Zenoh, or Zenoh with a router; all by "
    "default. For faults: ROS, which is the default, or Zenoh.",
)
@click.option(
    "--map",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="A movingai map to plan on, for traffic.",
)
@click.option(
    "--scen",
    type=click.Path(dir_okay=False, path_type=Path),
    multiple=True,
    metavar="FILE",
    help="What to plan on the map: a .scen or .pd file; may be repeated.",
)
@click.option(
    "--faults",
    type=click.IntRange(min=1),
    metavar="N",
    help="How many runs with faults are simulated, for traffic.",
)
@click.option("--local", is_flag=True, help="Without the traffic planner, for traffic.")
@click.option(
    "--people",
    type=click.IntRange(min=1),
    metavar="N",
    help="How many people walk among each fleet, for traffic.",
)
@click.option("--close", is_flag=True, help="A lane closes and opens again, for traffic.")
@click.option("--delays", is_flag=True, help="Robots stop for 1 to 3 s at random, for traffic.")
@click.option("--site", metavar="NAME", help="hall, lab or warehouse, for traffic.")
@click.option("--ros", is_flag=True, help="A hive on ROS, planned and local, for traffic.")
@click.option(
    "--adversarial",
    type=click.IntRange(min=1),
    is_flag=False,
    flag_value=LAYOUTS,
    metavar="[N]",
    help=f"In how many small hard layouts a fleet drives, {LAYOUTS} by default, for traffic.",
)
@click.option(
    "--resume",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Keep results; with the same file a measurement goes on, for architectures, faults, "
    "scale, soak and traffic.",
)
@pass_context
def bench(context: CliContext, name: str | None, file: Path | None, **options: object) -> None:
    """Measure; without a NAME, list what can be measured.

    \b
    Examples:
      hive bench
      hive bench system --robots 20 --json system.json
      hive bench failover --runs 20
      hive bench soak --minutes 30 --resume soak.jsonl
      hive bench faults --schedules 100000 --resume faults.jsonl
      hive bench faults --mutations
      hive bench faults --transport zenoh
      hive bench fuzz --messages 20000 --seed 7
      hive bench flake --runs 5
      hive bench architectures --robots 10 --runs 1
      hive bench auction --robots 10
      hive bench hive --robots 100
      hive bench learning --runs 1
      hive bench traffic --minutes 60 --runs 5 --resume hours.jsonl
      hive bench traffic --site lab --robots 4
      hive bench traffic --map room-32-32-4.map --scen room-32-32-4-random-1.scen
      hive bench traffic --faults 1000
      hive bench traffic --people 5
      hive bench traffic --close
      hive bench traffic --delays
      hive bench traffic --ros
      hive bench traffic --adversarial
      hive bench vda5050 --robots 50

    Ends with 0 when the measurement ran, whatever it found; architectures, faults, fuzz, fuzz-ros,
    hive and traffic end with 1 when a property was broken, sim and system when anything touched,
    faults --mutations when a mutation was not noticed.
    """  # noqa: D301  (to click, \b means: keep the lines)
    if name is None:
        if file is not None:
            raise click.UsageError("--json needs the NAME of a benchmark")
        for known, entry in sorted(BENCHES.items()):
            click.echo(f"{known:<12} {entry.line}")
        return
    result = _measure(BENCHES[name], name, context, options)
    here = machine()
    words = f"{here['processor']}, {here['cores']} cores, {here['memory']} GB, {here['system']}"
    date = datetime.now().astimezone().isoformat(timespec="seconds")
    click.echo("\n".join(_table(result)))
    if file is not None:
        _write(file, json.dumps(as_json(name, result, words, date), indent=2) + "\n")
    if result.broken:
        click.get_current_context().exit(1)


def _measure(
    entry: Bench, name: str, context: CliContext, options: Mapping[str, object]
) -> BenchResult:
    """Run the benchmark, with what the user chose, if anything."""
    chosen = {option: value for option, value in options.items() if value}
    for option in chosen:
        if option not in entry.options:
            raise click.UsageError(f"{name} takes no --{option}")
    return entry.run(context, chosen)


def _table(result: BenchResult) -> list[str]:
    """Return a line for each figure, with its aim if it has one."""
    width = max(map(len, result.figures))
    lines = []
    for name, value in result.figures.items():
        aim = ""
        if name in result.aims:
            verdict = "met" if result.met[name] else "NOT met"
            aim = f"   aim: at most {result.aims[name]:g}, {verdict}"
        lines.append(f"{name:<{width}}  {value:12.4f}{aim}")
    return lines


def _write(file: Path, text: str) -> None:
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise click.UsageError(f"{file} cannot be written: {error.strerror}") from None


def main() -> None:
    """Run this process as `bench`."""
    command_line.main(bench)
