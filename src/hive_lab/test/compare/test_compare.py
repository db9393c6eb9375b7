# SPDX-License-Identifier: BSD-3-Clause
"""The command `compare`, with real runs on virtual time."""

import json
from types import SimpleNamespace

import pytest

from fleet_manager.cli.context import CliContext
from fleet_manager.cli.main import run
from hive_common.errors import HiveError
from hive_lab.compare.command import compare
from hive_lab.compare.experiment import read_experiment
from hive_lab.compare.results import Results, load
from hive_lab.compare.run_all import Progress, run_all


@pytest.fixture
def mine(write_experiment):
    return write_experiment("decisions: [distributed, planned]\n")


def test_an_experiment_is_run_shown_and_can_be_repeated_from_its_folder(mine, tmp_path, capsys):
    code = run(
        CliContext(connect=None), [str(mine), "--results", str(tmp_path / "out")], command=compare
    )
    out, err = capsys.readouterr()
    (folder,) = (tmp_path / "out").iterdir()

    assert code == 0
    assert "time to done, mean [s]" in out
    assert "run 2 of 2: planned, latency, seed 1" in err
    again = read_experiment(str(folder / "experiment.yaml"))
    assert again.runs == read_experiment(str(mine)).runs
    assert again.scenario_of(1).tasks == read_experiment(str(mine)).scenario_of(1).tasks
    assert [len(runs) for runs in load(folder).reports.values()] == [1, 1]


def test_a_run_that_fails_names_itself(mine, tmp_path):
    experiment = read_experiment(str(mine))
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text(fleet.read_text("utf-8").replace("ld60", "nothing"), encoding="utf-8")

    with pytest.raises(HiveError, match="robot model 'nothing': not known"):
        run_all(experiment, tmp_path, lambda _progress: None)


def test_the_remaining_time_goes_by_the_runs_before(mine, tmp_path, monkeypatch):
    now, told = [0.0], []

    def pretend(_experiment, _variant, _seed, _picture, tell):
        for share in (0.5, 1.0):
            now[0] += 50.0
            tell(share)
        return {}

    monkeypatch.setattr("hive_lab.compare.run_all._apart", pretend)
    monkeypatch.setattr("hive_lab.compare.run_all.time", SimpleNamespace(monotonic=lambda: now[0]))

    run_all(read_experiment(str(mine)), tmp_path, told.append)

    shares, left = zip(*((each.share, each.remaining) for each in told), strict=True)
    assert shares == (0.0, 0.25, 0.5, 0.5, 0.75, 1.0)
    assert left == (None, 150.0, 100.0, 100.0, 50.0, 0.0)


def test_programs_get_the_progress_and_the_folder_as_lines_of_json(
    mine, tmp_path, capsys, monkeypatch
):
    def pretend(experiment, _folder, tell):
        tell(Progress("planned, latency, seed 1", 1, 2, 0.25, 30.0))
        return Results(experiment.name, "today", "here", {}, {}, {})

    monkeypatch.setattr("hive_lab.compare.command.run_all", pretend)

    words = [str(mine), "--progress", "--results", str(tmp_path)]
    assert run(CliContext(connect=None), words, command=compare) == 0
    first, last = map(json.loads, capsys.readouterr().out.splitlines())

    assert (first["share"], first["remaining"], first["runs"]) == (0.25, 30.0, 2)
    assert last["folder"].startswith(str(tmp_path))


def test_a_source_that_is_not_there_is_one_line_and_exit_2(tmp_path, capsys):
    code = run(CliContext(connect=None), [str(tmp_path / "no.yaml")], command=compare)

    assert code == 2
    assert "no.yaml: cannot be read" in capsys.readouterr().err
