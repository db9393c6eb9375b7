# SPDX-License-Identifier: BSD-3-Clause
"""The command `compare`."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fleet_manager.cli.context import FileName, new_folder
from fleet_manager.client.comparison import PAGE, TABLE
from fleet_manager.ros import command_line
from hive_common.resources import names_in
from hive_lab.compare.experiment import Experiment, read_experiment
from hive_lab.compare.figures import as_text, table_of
from hive_lab.compare.results import load, save, show, side_by_side
from hive_lab.compare.run_all import run_all

if TYPE_CHECKING:
    from collections.abc import Callable

    from hive_lab.compare.results import Results
    from hive_lab.compare.run_all import Progress


@click.command()
@click.argument(
    "sources", metavar="EXPERIMENT...", nargs=-1, type=FileName("fleet_manager", "experiments")
)
@click.option(
    "--results",
    type=click.Path(file_okay=False, path_type=Path),
    default="results",
    show_default=True,
    help="Folder for the folders of the runs.",
)
@click.option(
    "--progress", is_flag=True, help="Print the progress as lines of JSON, for programs."
)
def compare(sources: tuple[str, ...], results: Path, progress: bool) -> None:
    """Run experiments and show their results side by side; without one, list those that there are.

    An EXPERIMENT is the name of a file that comes with fleet_manager, the path of another, or a
    folder of results that an earlier comparison has saved, which is not run again.

    \b
    Examples:
      hive compare
      hive compare lab
      hive compare ./before.yaml ./after.yaml
      hive compare results/lab-20260101-120000 ./after.yaml

    The folder of each run holds its reports, table.csv, page.html with all tables and pictures,
    and the files from which it can be repeated. Ends with 0 when the runs were made, whatever they
    show.
    """  # noqa: D301  (to click, \b means: keep the lines)
    if not sources:
        for name in names_in("fleet_manager", "experiments"):
            click.echo(f"{name:<14} {read_experiment(name).description}")
        return
    tell = _tell_programs if progress else _TellPeople()
    read: list[Results | Experiment] = [
        load(Path(each)) if Path(each).is_dir() else read_experiment(each) for each in sources
    ]
    shown = [_results_of(each, results, tell) for each in read]
    folders = {folder for _, folder in shown if folder is not None}
    several = [found for found, _ in shown]
    folder = folders.pop() if len(several) == 1 and folders else new_folder(results, "compared")
    if len(several) > 1 or shown[0][1] is None:
        show(folder, several)
    if progress:
        click.echo(json.dumps({"folder": str(folder.resolve())}))
        return
    click.echo(as_text(table_of(side_by_side(several))), nl=False)
    click.echo(f"page:  {folder / PAGE}\ntable: {folder / TABLE}")


def _results_of(
    source: Results | Experiment, results: Path, tell: Callable[[Progress], None]
) -> tuple[Results, Path | None]:
    """Return the results of a source, and the folder into which they were saved just now."""
    if not isinstance(source, Experiment):
        return source, None
    folder = new_folder(results, source.name)
    found = run_all(source, folder, tell)
    save(folder, found)
    return found, folder


def _tell_programs(progress: Progress) -> None:
    click.echo(json.dumps(asdict(progress)))


class _TellPeople:
    """Prints a line when the next run begins."""

    def __init__(self) -> None:
        self._last = ""

    def __call__(self, progress: Progress) -> None:
        if progress.run == self._last:
            return
        self._last = progress.run
        left = "" if progress.remaining is None else f", about {progress.remaining:.0f} s left"
        click.echo(f"run {progress.number} of {progress.runs}: {progress.run}{left}", err=True)


def main() -> None:
    """Run this process as `compare`."""
    command_line.main(compare)
