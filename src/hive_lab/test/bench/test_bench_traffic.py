# SPDX-License-Identifier: BSD-3-Clause
"""The parts of the benchmark `traffic` that need no simulated hours."""

from __future__ import annotations

import dataclasses

import click
import pytest

pytest.importorskip("ompl")

from blackboard.consensus.messages import Heartbeat
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskUpdate
from blackboard.domain.task import TaskState
from fleet_manager.client.reports import TruePlace
from hive_common.pose import Pose
from hive_lab.bench.kept_runs import KeptRuns
from hive_lab.bench.traffic.fleets import FLEETS, LD60, Fleet, chosen, of_fleets
from hive_lab.bench.traffic.measure import run
from hive_lab.bench.traffic.through_ros import Account
from hive_lab.fleets.throughput import Throughput, Trouble


class HereAndNow:
    """Does runs at once, in this process; for `KeptRuns`."""

    def all_of(self, jobs):
        return [function(*values) for function, values in jobs.values()]


@pytest.mark.parametrize(
    ("site", "robots", "names"),
    [
        (None, None, [fleet.name for fleet in FLEETS]),
        ("lab", None, ["lab 4", "lab 8", "lab 4 mixed"]),
        ("lab", 4, ["lab 4", "lab 4 mixed"]),
        (None, 40, ["hall 40 mixed"]),
        ("hall", 12, ["hall 12"]),
    ],
)
def test_fleets_are_chosen_by_site_and_number(site, robots, names):
    assert [fleet.name for fleet in chosen(site, robots)] == names


@pytest.mark.parametrize(
    ("choice", "said"),
    [
        ({"site": "garage"}, "--site garage; allowed: hall, lab, warehouse"),
        ({"robots": 7}, "--robots 7 needs a --site"),
        ({"close": True, "local": True}, "--close needs the traffic planner"),
        ({"scen": ["a.scen"]}, "--map and --scen need each other"),
    ],
)
def test_options_that_do_not_go_together_are_refused(choice, said):
    with pytest.raises(click.UsageError, match=said):
        run(lambda _: None, **choice)


def test_a_small_fleet_is_measured_and_its_kept_run_gives_the_same_figures(tmp_path, monkeypatch):
    monkeypatch.setattr("hive_lab.bench.traffic.fleets.ALONE", 60.0)
    fleet = Fleet("lab", 2, LD60, 0.5)
    results = [
        of_fleets([fleet], 60.0, 1, Trouble(), KeptRuns(tmp_path / "runs"), planned=True)
        for _ in range(2)
    ]

    assert results[0] == results[1]
    assert results[0].figures["lab 2 contacts"] == 0.0
    assert results[0].figures["lab 2 goals per hour and robot"] > 60.0


def test_fleets_that_are_delayed_are_compared_with_the_same_fleets_undelayed(monkeypatch):
    def driven(fleet, _seed, seconds, planned=False, trouble=None):
        times = 40.0 if trouble is not None and trouble.delays else 32.0
        drives = [("robot1", (0.0, 0.0), (x, 0.0, 0.0), 0.0, times, "") for x in (9.0, 11.0)]
        drove = measured(fleet.robots, seconds, drives)
        return drove if planned else drove | {"drives": alone}

    alone = [("robot1", (0.0, 0.0), (x, 0.0, 0.0), 0.0, 3.0 * x, "") for x in (5.0, 10.0, 15.0)]
    monkeypatch.setattr("hive_lab.bench.traffic.fleets._driven", driven)
    monkeypatch.setattr("hive_lab.fleets.throughput.TimeAlone._length", lambda _, d: d.goal[0])

    trouble = Trouble(delays=True)
    result = of_fleets([Fleet("lab", 2)], 60.0, 1, trouble, HereAndNow(), planned=True)

    assert result.figures["lab 2 loses"] == pytest.approx(1 - 30 / 40)
    assert result.figures["lab 2 loses by delays"] == pytest.approx(1 - 32 / 40)
    assert result.aims["lab 2 loses by delays"] == 0.05


def measured(robots, seconds, drives):
    """Return what is kept of a run without contacts."""
    drove = Throughput(robots, seconds, (), {"robot1": "ld60"}, 0, 0, 0, 0.0, 0.0, 0, 0.0, 0.0)
    return dataclasses.asdict(drove) | {"drives": drives}


def test_legs_of_tours_are_counted_once_each():
    account = Account(lambda: 0.0)
    for state, step in (("STARTED", 0), ("STARTED", 1), ("STARTED", 1), ("DONE", 1)):
        account(TaskUpdate("T1", TaskState[state], step=step, steps=4), ())
    account(TaskUpdate("T2", TaskState.FAILED, step=2, steps=4), ())

    assert (account.legs, account.failed) == (4, 1)


def test_the_longest_time_between_two_heartbeats_is_kept():
    times = iter((5.0, 5.2, 5.9, 6.1))
    account = Account(lambda: 0.0, lambda: next(times))
    for number in range(4):
        account(Heartbeat(1, "blackboard", "robot1", ("blackboard",), number), ())

    assert account.heartbeat_gap == pytest.approx(0.7)


def test_a_robot_stands_while_it_has_a_task_and_does_not_move():
    times = iter((0.0, 50.0, 60.0, 67.0, 90.0))
    account = Account(lambda: next(times))
    for x, task in ((0.0, ""), (0.0, "T1"), (1.0, "T1"), (1.0, "T1"), (1.0, "")):
        account(RobotStatus("r", RobotState.BUSY, Pose(x, 0.0), 1.0, task_id=task), ())
        account(TruePlace("r", x, 0.0), ())

    assert account.longest_stand == 7.0
