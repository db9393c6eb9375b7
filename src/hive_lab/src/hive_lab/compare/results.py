# SPDX-License-Identifier: BSD-3-Clause
"""Saved results: a folder with the reports of all runs, and with what is needed to repeat them."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fleet_manager.client.comparison import PAGE, SHOWN, TABLE
from fleet_manager.demo.machine import machine, versions
from hive_common.errors import FileError
from hive_lab.compare.figures import as_csv, rows_of, table_of
from hive_lab.compare.page import draw_side_by_side, write_page

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path


RUNS = "runs.json"
SIDE_BY_SIDE = "side_by_side.png"


@dataclass(frozen=True)
class Results:
    """The results of one experiment.

    Attributes:
        name: The experiment's name.
        date: When it began, ISO 8601.
        machine: Where it ran, in words.
        reports: The reports of the runs by the label of their variant.
        pictures: The picture of each run, by a heading.
        sources: Every file that is needed to repeat it, by its path in the folder.
        description: What the experiment is for.
    """

    name: str
    date: str
    machine: str
    reports: Mapping[str, Sequence[Mapping[str, Any]]]
    pictures: Mapping[str, Path]
    sources: Mapping[str, bytes]
    description: str = ""


def machine_words() -> str:
    """Return what this machine and its software are, in words."""
    here, software = machine(), versions()
    return (
        f"{here['processor']}, {here['cores']} cores, {here['memory']} GB, {here['system']}, "
        f"Robo-Hive {software['robo_hive']}"
    )


def save(folder: Path, results: Results) -> None:
    """Write results into a folder: reports, sources, table, picture and page."""
    for name, content in results.sources.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(content)
    kept = {
        "name": results.name,
        "description": results.description,
        "date": results.date,
        "machine": results.machine,
        "pictures": {title: file.name for title, file in results.pictures.items()},
        "sources": list(results.sources),
        "reports": results.reports,
    }
    text = json.dumps(kept, indent=1, ensure_ascii=False) + "\n"
    (folder / RUNS).write_text(text, encoding="utf-8")
    show(folder, [results])


def load(folder: Path) -> Results:
    """Read the results that `save` wrote into a folder.

    Raises:
        FileError: The folder holds none.
    """
    file = folder / RUNS
    try:
        kept = json.loads(file.read_text(encoding="utf-8"))
        return Results(
            kept["name"],
            kept["date"],
            kept["machine"],
            kept["reports"],
            {title: folder / name for title, name in kept["pictures"].items()},
            {name: (folder / name).read_bytes() for name in kept["sources"]},
            kept.get("description", ""),
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        allowed = "a folder that `hive compare` has written, or an experiment (.yaml)"
        raise FileError(f"{folder}: holds no results; allowed: {allowed}") from None


def side_by_side(several: Sequence[Results]) -> dict[str, Sequence[Mapping[str, Any]]]:
    """Return the reports of several results by labels that differ: the variants of all of them."""
    if len(several) == 1:
        return dict(several[0].reports)
    names = [results.name for results in several]
    together = {}
    for number, results in enumerate(several, start=1):
        name = results.name if names.count(results.name) == 1 else f"{results.name} {number}"
        for label, reports in results.reports.items():
            together[f"{name}: {label}"] = reports
    return together


def show(folder: Path, several: Sequence[Results]) -> None:
    """Write tables, picture and page of several results side by side into a folder."""
    reports = side_by_side(several)
    table = table_of(reports)
    (folder / TABLE).write_text(as_csv(reports), encoding="utf-8")
    draw_side_by_side(folder / SIDE_BY_SIDE, table)
    pictures = {"side by side": folder / SIDE_BY_SIDE}
    sources: dict[str, str] = {}
    for results in several:
        prefix = f"{results.name}: " if len(several) > 1 else ""
        pictures |= {f"{prefix}{title}": file for title, file in results.pictures.items()}
        sources |= {
            f"{prefix}{name}": content.decode()
            for name, content in results.sources.items()
            if name.endswith(".yaml")
        }
    # What windows show, so that they need not know how figures are made.
    words = " ".join(dict.fromkeys(each.description for each in several if each.description))
    shown = {
        "description": words,
        "table": rows_of(table),
        "pictures": {title: os.path.relpath(file, folder) for title, file in pictures.items()},
    }
    (folder / SHOWN).write_text(json.dumps(shown, indent=1) + "\n", encoding="utf-8")
    made = "; ".join(f"{each.name}: {each.date}, {each.machine}" for each in several)
    facts = f"{words} {made}".strip()
    name = " and ".join(dict.fromkeys(each.name for each in several))
    write_page(folder / PAGE, name, facts, table, pictures, sources)
