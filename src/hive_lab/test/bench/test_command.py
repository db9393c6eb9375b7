# SPDX-License-Identifier: BSD-3-Clause
import contextlib

import pytest

from blackboard.errors import LiveHiveError
from fleet_manager.cli.context import CliContext
from fleet_manager.cli.main import run
from fleet_manager.testing import FakeLink
from hive_lab.bench.command import bench
from hive_lab.bench.registry import BENCHES, BenchResult


@pytest.fixture
def terminal(capsys):
    """Run `bench` with words; return exit code, stdout, stderr."""

    def call(*words):
        context = CliContext(lambda _record: contextlib.nullcontext(FakeLink()))
        code = run(context, list(words), bench)
        return code, *capsys.readouterr()

    return call


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["speed"], "'plan', 'scale', 'sim', 'soak', 'start', 'system'"),
        (["plan", "--runs", "3"], "plan takes no --runs"),
        (["--json", "x.json"], "NAME"),
    ],
)
def test_a_mistake_in_the_words_is_one_line_and_exit_2(terminal, words, said):
    code, out, err = terminal(*words)

    assert (code, out) == (2, "")
    assert said in err


def test_bench_without_a_name_lists_the_benchmarks(terminal):
    code, out, _ = terminal()

    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == sorted(BENCHES)


@pytest.mark.parametrize(("violations", "expected"), [(0.0, 0), (2.0, 1)])
def test_bench_faults_ends_with_1_when_a_property_was_broken(
    terminal, monkeypatch, violations, expected
):
    wanted = []

    def simulate(schedules):
        wanted.append(schedules)
        return BenchResult({"violations": violations}, {"violations": 0.0}, violations > 0)

    monkeypatch.setattr("hive_lab.bench.faults.run", simulate)

    code, out, _ = terminal("faults", "--schedules", "7")

    assert (code, wanted) == (expected, [7])
    assert "violations" in out


@pytest.mark.parametrize(
    ("name", "module"), [("sim", "live.simulator"), ("system", "bench.system")]
)
@pytest.mark.parametrize("broken", [False, True])
def test_bench_sim_and_system_end_with_1_when_anything_touched(
    terminal, monkeypatch, name, module, broken
):
    pytest.importorskip("blackboard.msg", reason="benchmarks of processes need ROS")
    monkeypatch.setattr(
        f"hive_lab.{module}.run", lambda _connect: BenchResult({"contacts": 1.0}, {}, broken)
    )

    code, out, _ = terminal(name)

    assert code == int(broken)
    assert "contacts" in out


def test_the_help_says_which_benchmarks_end_with_1(terminal):
    _, out, _ = terminal("--help")

    said = " ".join(out.split())
    assert "hive and traffic end with 1 when a property was broken, sim and system when" in said
    assert "faults --mutations when a mutation was not noticed" in said


def test_bench_says_in_one_line_that_a_hive_was_too_slow_to_be_measured(terminal, monkeypatch):
    pytest.importorskip("blackboard.msg", reason="benchmarks of processes need ROS")

    def wait_in_vain(robots, transport):
        raise LiveHiveError(f"not within 60 s: {robots} robots bid over {transport}")

    monkeypatch.setattr("hive_lab.bench.registry.local_hive", contextlib.nullcontext)
    monkeypatch.setattr("hive_lab.live.auction.run", wait_in_vain)

    code, _, err = terminal("auction", "--robots", "7", "--transport", "zenoh")

    assert code == 4
    assert err.startswith("hive: the hive was too slow to be measured: ")
    assert err.endswith(": not within 60 s: 7 robots bid over zenoh\n")


def test_bench_refuses_a_number_of_schedules_where_there_are_none(terminal):
    code, _, err = terminal("plan", "--schedules", "7")

    assert code == 2
    assert "plan takes no --schedules" in err
