# SPDX-License-Identifier: BSD-3-Clause
"""The command `demo`: a whole hive at work, from nothing to a report."""

from __future__ import annotations

import json
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fleet_manager.cli.outside import FileName, pass_outside
from fleet_manager.config.fleet_file import read_fleet
from fleet_manager.config.scenario import read_scenario
from fleet_manager.demo.local_hive import local_hive
from fleet_manager.demo.machine import machine, versions
from fleet_manager.demo.report import not_done
from fleet_manager.demo.runner import DemoPlan, run_demo
from fleet_manager.demo.screen import screen_is_usable
from fleet_manager.errors import NotDoneError
from hive_common.map_file import load_map

if TYPE_CHECKING:
    from fleet_manager.cli.outside import Outside
    from fleet_manager.demo.runner import DemoResult


@click.command()
@click.option(
    "--scenario",
    type=FileName("fleet_manager", "scenarios"),
    default="demo",
    show_default=True,
    help="What is posted: name or path of a scenario file.",
)
@click.option(
    "--fleet",
    type=FileName("fleet_manager", "fleets"),
    help="Who does it: name or path of a fleet file; the scenario's own where not given.",
)
@click.option(
    "--rtf",
    type=click.FloatRange(0.1, 20),
    default=1.0,
    show_default=True,
    help="Real-time factor: the hive's time per time on the wall.",
)
@click.option(
    "--windows/--headless",
    default=None,
    help="Open RViz and the operator's windows, or none; where not given: as the screen allows.",
)
@click.option(
    "--results",
    type=click.Path(file_okay=False, path_type=Path),
    default="results",
    show_default=True,
    help="Folder in which a folder for this run is made.",
)
@pass_outside
def demo(
    outside: Outside,
    scenario: str,
    fleet: str | None,
    rtf: float,
    windows: bool | None,
    results: Path,
) -> None:
    """Start a simulated hive, let it do a scenario, and end by itself.

    Runs on a ROS master of its own, unless ROS_MASTER_URI names one; several demos can run at the
    same time. Leaves a picture and a JSON report, and no process behind.

    \b
    Examples:
      hive demo
      hive demo --scenario warehouse --rtf 2
      hive demo --fleet ./my_fleet.yaml --headless

    Ends with 0 only if every task is DONE and nothing collided; otherwise it says what is not.
    """  # noqa: D301  (to click, \b means: keep the lines)
    what = read_scenario(scenario)
    plan = DemoPlan(
        scenario=what,
        fleet=read_fleet(fleet or what.fleet),
        rtf=rtf,
        windows=screen_is_usable() if windows is None else windows,
    )
    folder = _new_folder(results, f"{what.name}-{datetime.now().astimezone():%Y%m%d-%H%M%S}")
    with local_hive(folder) as hive:
        seen = "with RViz and the windows" if plan.windows else "without windows"
        click.echo(
            f"starting {len(plan.robots)} robots in the {what.world}, {seen}, logs in {folder}/log"
        )
        click.echo(f"to look on from another terminal: export ROS_MASTER_URI={hive.uri}")
        result = run_demo(plan, hive, outside.connect, click.get_text_stream("stdout"))
    _write(folder, what.map, result)
    _tell(folder, result)


def _new_folder(results: Path, name: str) -> Path:
    """Make and return a folder that no other run has, even one started in the same second."""
    for ending in ("", *(f"-{number}" for number in range(2, 100))):
        folder = results / f"{name}{ending}"
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            continue
        except OSError as error:
            raise click.UsageError(f"{folder} cannot be made: {error.strerror}") from None
        return folder
    raise click.UsageError(f"{results} has 99 runs of this second; choose another --results")


def _write(folder: Path, chart: str, result: DemoResult) -> None:
    """Write the report and the picture."""
    # matplotlib takes a second to import, which no other command should feel
    from fleet_manager.demo.picture import draw_run  # noqa: PLC0415  (see above)

    report = {**result.report, "versions": versions(), "machine": machine()}
    text = json.dumps(report, indent=2, ensure_ascii=False) + "\n"
    (folder / "report.json").write_text(text, encoding="utf-8")
    draw_run(folder / "picture.png", report, result.history, load_map(chart))


def _tell(folder: Path, result: DemoResult) -> None:
    """Say how it went; raise NotDoneError where it did not go well."""
    report = result.report
    tasks, hits = report["tasks"], report["collisions"]
    collided = f"{hits} COLLISION{'S' * (hits > 1)}" if hits else "no collision"
    seconds = f"{report['time']['hive']:.0f} s"
    click.echo(f"{report['done']} of {len(tasks)} tasks done in {seconds}, {collided}")
    for robot in report["robots"]:
        click.echo(
            f"  {robot['name']}: {robot['done']} tasks, {robot['distance']:.0f} m, "
            f"{robot['energy'] / 1000:.1f} kJ, busy {robot['busy_share']:.0%} of the time"
        )
    for remark in result.remarks:
        click.echo(f"note: {remark}")
    click.echo(f"picture: {folder / 'picture.png'}\nreport:  {folder / 'report.json'}")
    wrong = not_done(report)
    if wrong:
        raise NotDoneError(
            f"{len(wrong)} of {len(tasks)} tasks not done:\n  " + "\n  ".join(wrong)
        )
    if hits:
        raise NotDoneError(f"collisions counted by the simulator: {hits}")
