# SPDX-License-Identifier: BSD-3-Clause
"""The benchmark of architectures counts what it says, and its runs can be drawn."""

import json

import pytest
from PIL import Image

from hive_common.errors import FileError
from hive_lab.architectures.kinds import ARCHITECTURES
from hive_lab.architectures.run import CONDITIONS, Outcome
from hive_lab.bench.architectures import measure, picture
from hive_lab.bench.architectures.measure import FAULTY, SIZES, groups, over_seeds, run_name

OUTCOME = Outcome(
    not_done=1,
    done_twice=0,
    time_to_done=30.0,
    time_to_done_95=60.0,
    makespan=90.0,
    energy=5000.0,
    answer=0.1,
    unanswered=0,
    messages=100.0,
    bytes=1000.0,
    busiest=0.02,
    others=0.01,
    all=0.05,
    posted=(0.0, 10.0, 20.0),
    ended=(40.0, 90.0),
)


def test_tasks_not_done_are_summed_over_the_seeds_and_times_are_medians():
    runs = [OUTCOME._replace(time_to_done=each)._asdict() for each in (10.0, 20.0, 90.0)]

    figures = over_seeds(runs)

    assert figures["time_to_done"] == 20.0
    assert figures["not_done"] == 3.0
    assert "posted" not in figures


def test_only_some_sizes_are_run_under_every_condition():
    found = list(groups((2, 10), (10,)))

    assert {group.condition for group in found if group.robots == 10} == set(CONDITIONS)
    assert {group.condition for group in found if group.robots == 2} == {"usual"}
    assert len(found) == 4 * len(ARCHITECTURES)


@pytest.mark.parametrize(("not_done", "broken"), [(0, False), (1, True)])
def test_a_hive_that_leaves_a_task_undone_has_broken_a_promise(tmp_path, not_done, broken):
    file = tmp_path / "runs.jsonl"
    keep(file, (4,), (4,), seeds=1, not_done=not_done)

    result = measure.run(robots=4, runs=1, resume=file)

    assert result.broken is broken
    assert result.met["4_robots_killed_planned_not_done"] is not broken
    assert "4_robots_killed_central_not_done" not in result.aims


def test_what_has_been_kept_is_drawn(tmp_path):
    file = tmp_path / "runs.jsonl"
    keep(file, SIZES, FAULTY, seeds=2)
    runs = picture.read(file)

    picture.draw_figures(runs, tmp_path / "figures.png")
    picture.draw_faults(runs, FAULTY[-1], tmp_path / "faults.png")

    assert all(len(each) == 2 for each in runs.values())
    for name in ("figures.png", "faults.png"):
        with Image.open(tmp_path / name) as image:
            assert len(image.getcolors(maxcolors=1_000_000)) > 100


def test_a_file_without_some_of_the_runs_is_refused_in_words(tmp_path):
    file = tmp_path / "runs.jsonl"
    keep(file, (4,), (4,), seeds=1)

    with pytest.raises(FileError, match=r"no run 'report, 2 robots, usual, seed 1'; `./hive"):
        picture.read(file)


def keep(file, sizes, faulty, seeds, **changes):
    """Write runs as `--resume` does."""
    lines = [
        {"run": run_name(group, seed), "result": OUTCOME._replace(**changes)._asdict()}
        for group in groups(sizes, faulty)
        for seed in range(1, seeds + 1)
    ]
    file.write_text("".join(json.dumps(line) + "\n" for line in lines))
