# SPDX-License-Identifier: BSD-3-Clause
"""Figures of runs, and what is saved of them."""

import csv
import json
import math

import pytest
from PIL import Image

from fleet_manager.client.comparison import PAGE, SHOWN, TABLE
from hive_common.errors import FileError
from hive_lab.compare.figures import as_text, figures_of, table_of
from hive_lab.compare.results import Results, load, save, show, side_by_side


def report(*ends, seed=1, lost=0):
    """Return the report of a run whose tasks are posted at 2 s and done at some times."""
    done = [
        {"id": f"T{n}", "state": "DONE", "posted": 2.0, "ended": end, "waiting": 1.0}
        for n, end in enumerate(ends)
    ]
    open_ = {"state": "STARTED", "posted": 2.0, "ended": None, "waiting": 9.0}
    robots = [
        {"name": "robot1", "busy_share": 0.5, "distance": 12.0, "energy": 3000.0},
        {"name": "robot2", "busy_share": 0.25, "distance": 8.0, "energy": 1000.0},
    ]
    return {"tasks": [*done, *[open_] * lost], "robots": robots, "collisions": 0, "seed": seed}


@pytest.fixture
def results(tmp_path):
    folder = tmp_path / "one"
    folder.mkdir()
    picture = folder / "run.png"
    Image.new("RGB", (4, 4)).save(picture)
    found = Results(
        "lab <1>",
        "2026-01-01T00:00:00+00:00",
        "a machine",
        {"planned, latency": [report(12.0, 22.0), report(32.0, seed=2)]},
        {"planned, latency, seed 1": picture},
        {"experiment.yaml": b"fleet: ./fleet.yaml\n", "maps/mine.pgm": b"P5 \xff"},
        "What it is for.",
    )
    save(folder, found)
    return folder, found


def test_figures_count_tasks_that_are_done():
    found = figures_of(report(12.0, 22.0, lost=1))

    assert (found["done"], found["tasks"]) == (2, 3)
    assert found["time_to_done"] == 15.0
    assert found["makespan"] == 20.0
    assert found["waiting"] == 1.0
    assert found["utilisation"] == 37.5
    assert (found["distance"], found["energy"]) == (20.0, 4.0)


def test_a_run_in_which_nothing_was_done_has_no_times():
    found = figures_of(report(lost=2))

    assert math.isnan(found["time_to_done"])
    assert "-" in as_text(table_of({"a": [report(lost=2)]}))


def test_a_table_gives_the_median_and_the_range_of_the_runs():
    text = as_text(table_of({"a": [report(12.0), report(22.0), report(72.0)]}))

    assert "20.0 (10.0..70.0)" in text


def test_results_that_were_saved_are_read_again(results):
    folder, found = results

    assert load(folder) == found


def test_the_page_holds_everything_and_needs_no_other_file(results):
    folder, _ = results
    page = (folder / PAGE).read_text(encoding="utf-8")

    assert page.count("data:image/png;base64,") == 2
    assert "20.0 (15.0..30.0)" not in page
    assert "22.5 (15.0..30.0)" in page
    assert "lab &lt;1&gt;" in page
    assert "fleet: ./fleet.yaml" in page
    assert 'src="run' not in page


def test_the_table_of_a_spreadsheet_has_a_line_for_each_run(results):
    folder, _ = results
    lines = list(csv.DictReader((folder / TABLE).read_text(encoding="utf-8").splitlines()))

    assert [(line["seed"], line["time to done, mean [s]"]) for line in lines] == [
        ("1", "15"),
        ("2", "30"),
    ]


def test_two_saved_results_are_compared_under_names_that_differ(results, tmp_path):
    _, found = results

    assert list(side_by_side([found, found])) == [
        "lab <1> 1: planned, latency",
        "lab <1> 2: planned, latency",
    ]
    together = tmp_path / "both"
    together.mkdir()
    show(together, [found, found])
    shown = json.loads((together / SHOWN).read_text(encoding="utf-8"))
    assert len(shown["table"][0]) == 3
    assert shown["description"] == "What it is for."
    assert all((together / file).is_file() for file in shown["pictures"].values())


def test_a_folder_without_results_is_refused_in_one_line(tmp_path):
    with pytest.raises(FileError, match="holds no results; allowed: a folder that `hive compare`"):
        load(tmp_path)
