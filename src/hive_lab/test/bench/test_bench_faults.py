# SPDX-License-Identifier: BSD-3-Clause
import click
import pytest

pytest.importorskip("blackboard.msg", reason="needs generated messages")


from hive_lab.bench import faults, mutations
from hive_lab.fault_schedules.draw import draw
from hive_lab.fault_schedules.run import run as run_schedule


@pytest.fixture
def simulated(monkeypatch):
    """Run schedules in this process, in pieces of two; return the seeds that were run."""
    seeds = []

    def simulate(wanted, *, zenoh):
        for seed in wanted:
            seeds.append(seed)
            yield run_schedule(draw(seed, zenoh=zenoh))

    monkeypatch.setattr(faults, "simulate", simulate)
    monkeypatch.setattr(faults, "_PIECE", 2)
    monkeypatch.setattr(faults, "_idle_hive", dict)
    return seeds


def test_a_measurement_of_faults_goes_on_where_it_was_and_adds_up(simulated, tmp_path):
    file = tmp_path / "faults.jsonl"
    part = faults.run(2, first=20, resume=file)
    whole = faults.run(4, first=20, resume=file)
    at_once = faults.run(4, first=20)

    assert simulated == [20, 21, 22, 23, 20, 21, 22, 23]
    assert part.figures["schedules"] == 2
    timeless = [name for name in whole.figures if not name.endswith("per_second")]
    assert {name: whole.figures[name] for name in timeless} == {
        name: pytest.approx(at_once.figures[name]) for name in timeless
    }


def test_results_over_zenoh_are_kept_apart_and_have_what_fails_there(simulated, tmp_path):
    file = tmp_path / "faults.jsonl"
    faults.run(2, resume=file)
    zenoh = faults.run(2, resume=file, transport="zenoh")

    assert simulated == [0, 1, 0, 1]
    assert zenoh.figures["faults_connections_lost"] > 0
    assert zenoh.aims == {"violations": 0.0}


def test_a_transport_that_is_not_simulated_is_refused():
    with pytest.raises(click.UsageError, match="no --transport router; allowed: ros, zenoh"):
        faults.run(1, transport="router")


def test_pieces_of_another_program_are_named(simulated, tmp_path, monkeypatch, capsys):
    file = tmp_path / "faults.jsonl"
    monkeypatch.setattr(faults, "program_tree", lambda: "abc1234")
    faults.run(2, resume=file)
    assert "other programs" not in capsys.readouterr().err
    monkeypatch.setattr(faults, "program_tree", lambda: "def5678")
    faults.run(4, resume=file)

    assert "the commits: abc1234, def5678" in capsys.readouterr().err
    assert simulated == [0, 1, 2, 3]


def test_a_mutation_that_no_schedule_notices_breaks_the_measurement(monkeypatch, capsys):
    two = [each for each in mutations.MUTATIONS if each.where in {"rivals", "late vote"}]
    monkeypatch.setattr(mutations, "MUTATIONS", two)

    missed, found = faults.run(1, mutations=True), faults.run(9, mutations=True)

    assert (missed.figures["not_noticed"], missed.broken) == (1, True)
    assert (found.figures["not_noticed"], found.broken) == (0, False)
    assert found.figures["schedules_to_vote_twice_in_an_epoch"] == 1
    assert (
        found.figures["most_schedules"] == found.figures["schedules_to_count_a_vote_however_late"]
    )
    assert "count a vote however late: NOT noticed\n" in capsys.readouterr().err


def test_a_search_for_a_mutation_goes_on_where_it_was(monkeypatch, tmp_path):
    file = tmp_path / "mutations.jsonl"
    one = [each for each in mutations.MUTATIONS if each.where == "rivals"]
    monkeypatch.setattr(mutations, "MUTATIONS", one)
    first = faults.run(1, mutations=True, resume=file)
    monkeypatch.setattr(mutations, "search", None)

    assert faults.run(1, mutations=True, resume=file) == first
