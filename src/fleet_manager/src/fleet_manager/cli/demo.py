# SPDX-License-Identifier: BSD-3-Clause
"""The command `demo`: runs a scenario on a simulated hive and writes a report."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from blackboard.domain.settings import TRAFFIC
from fleet_manager.cli.context import FileName, new_folder, pass_context
from fleet_manager.config.fleet_file import read_fleet
from fleet_manager.config.places import places_of
from fleet_manager.config.scenario import read_scenario
from fleet_manager.demo.local_hive import local_hive
from fleet_manager.demo.machine import machine, screen_is_usable, versions
from fleet_manager.demo.page import write_page
from fleet_manager.demo.picture import draw_run, figures
from fleet_manager.demo.report import not_done
from fleet_manager.demo.runner import DemoPlan, run_demo
from fleet_manager.errors import NotDoneError
from hive_common.map_file import load_map

if TYPE_CHECKING:
    from fleet_manager.cli.context import CliContext
    from fleet_manager.config.scenario import Scenario
    from fleet_manager.demo.runner import DemoResult


@click.command()
@click.option(
    "--scenario",
    type=FileName("fleet_manager", "scenarios"),
    default="demo",
    show_default=True,
    help="The tasks: name or path of a scenario file.",
)
@click.option(
    "--fleet",
    type=FileName("fleet_manager", "fleets"),
    help="The robots: name or path of a fleet file; the scenario's own by default.",
)
@click.option(
    "--traffic",
    type=click.Choice(TRAFFIC),
    help="Who decides which robot goes first; by default, as the fleet file says.",
)
@click.option(
    "--rtf",
    type=click.FloatRange(0.1, 20),
    default=1.0,
    show_default=True,
    help="Real-time factor: simulated time per real time.",
)
@click.option(
    "--windows/--headless",
    default=None,
    help="Open RViz and the operator's windows; by default, if there is a screen.",
)
@click.option(
    "--results",
    type=click.Path(file_okay=False, path_type=Path),
    default="results",
    show_default=True,
    help="Folder for the folder of this run.",
)
@pass_context
def demo(
    context: CliContext,
    scenario: str,
    fleet: str | None,
    traffic: str | None,
    rtf: float,
    windows: bool | None,
    results: Path,
) -> None:
    """Start a simulated hive, run a scenario on it, and stop it.

    The demo has its own ROS master, unless ROS_MASTER_URI names one, so several demos can run at
    the same time. It leaves a picture and a JSON report, and no process.

    \b
    Examples:
      hive demo
      hive demo --scenario warehouse --rtf 2
      hive demo --traffic local
      hive demo --fleet ./my_fleet.yaml --headless

    Exits with 0 only if every task is DONE and nothing collided; otherwise it names what
    went wrong.
    """  # noqa: D301  (to click, \b means: keep the lines)
    what = read_scenario(scenario)
    plan = DemoPlan(
        scenario=what,
        fleet=read_fleet(fleet or what.fleet),
        rtf=rtf,
        windows=screen_is_usable() if windows is None else windows,
        traffic=traffic or "",
    )
    folder = new_folder(results, what.name)
    with local_hive(folder) as hive:
        seen = "with RViz and the windows" if plan.windows else "without windows"
        click.echo(
            f"starting {len(plan.robots)} robots in the {what.world}, {seen}, logs in {folder}/log"
        )
        click.echo(f"to follow from another terminal: export ROS_MASTER_URI={hive.uri}")
        result = run_demo(plan, hive, context.connect, click.get_text_stream("stdout"))
    _write(folder, what, result)
    _tell(folder, result)


def _write(folder: Path, what: Scenario, result: DemoResult) -> None:
    """Write the report as data and as a page, and the picture."""
    report = {**result.report, "versions": versions(), "machine": machine()}
    text = json.dumps(report, indent=2, ensure_ascii=False) + "\n"
    (folder / "report.json").write_text(text, encoding="utf-8")
    picture = folder / "picture.png"
    draw_run(picture, report, result.history, load_map(what.map), places_of(what.world))
    write_page(folder / "report.html", report, picture, result.log)


def _tell(folder: Path, result: DemoResult) -> None:
    """Print a summary; raise NotDoneError unless every task is DONE and nothing collided."""
    report = result.report
    tasks, hits = report["tasks"], report["collisions"]
    collided = f"{hits} COLLISION{'S' * (hits > 1)}" if hits else "no collisions"
    seconds = f"{report['time']['hive']:.0f} s"
    click.echo(f"{report['done']} of {len(tasks)} tasks done in {seconds}, {collided}")
    for robot in report["robots"]:
        click.echo(
            f"  {robot['name']}: {robot['done']} tasks, {robot['distance']:.0f} m, "
            f"{robot['energy'] / 1000:.1f} kJ, busy {robot['busy_share']:.0%} of the time"
        )
    for remark in result.remarks:
        click.echo(f"note: {remark}")
    click.echo(figures(report))
    click.echo(f"report: {folder / 'report.html'}, with picture.png and report.json beside it")
    wrong = not_done(report)
    if wrong:
        raise NotDoneError(
            f"{len(wrong)} of {len(tasks)} tasks not done:\n  " + "\n  ".join(wrong)
        )
    if hits:
        raise NotDoneError(f"collisions counted by the simulator: {hits}")
