# SPDX-License-Identifier: BSD-3-Clause
"""The command that runs fault schedules."""

import pytest

from hive_lab.fault_schedules.run import main


@pytest.mark.parametrize("option", ["--scenario", "--mood"])
def test_a_schedule_runs_in_a_scenario_and_says_how_to_run_it_again(option, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["run", "3", option, "lost disks"])

    main()

    said = capsys.readouterr().out
    assert said.startswith("seed 3 (lost disks), blackboard and ")
    assert "every property holds" in said
    assert 'python3 -m hive_lab.fault_schedules.run 3 --scenario "lost disks"' in said


def test_a_schedule_runs_over_zenoh_and_says_how_to_run_it_again(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["run", "7", "--transport", "zenoh"])

    main()

    said = capsys.readouterr().out
    assert "over Zenoh" in said.splitlines()[0]
    assert "to run it again: python3 -m hive_lab.fault_schedules.run 7 --transport zenoh" in said
