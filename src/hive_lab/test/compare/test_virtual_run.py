# SPDX-License-Identifier: BSD-3-Clause
"""Runs on virtual time: every architecture, failing processes, and messages that are lost."""

import pytest
from attrs import evolve

from fleet_manager.client.comparison import ARCHITECTURES
from hive_lab.architectures.ledger import Ledger
from hive_lab.compare.experiment import read_experiment
from hive_lab.compare.simulated_trial import SimulatedTrial
from hive_lab.compare.virtual_run import run_virtual
from simenv.world.world_file import load_world

LATER = """\
  - {id: C, type: GAB, goals: [[4.0, 2.2], [2.6, 2.6]], after: 14}
  - {id: D, type: GA, goals: [[4.0, 4.2]], after: 14}
"""


@pytest.fixture
def mine(write_experiment):
    """Return a function that writes an experiment and reads it."""
    return lambda more="", tasks="": read_experiment(
        str(write_experiment(f"decisions: [distributed]\n{more}", tasks))
    )


@pytest.fixture
def killed(monkeypatch):
    """Return the names of the nodes that are killed."""
    names, kill = [], SimulatedTrial.kill

    def noted(trial, name):
        names.append(name)
        kill(trial, name)

    monkeypatch.setattr(SimulatedTrial, "kill", noted)
    return names


def virtual(experiment):
    """Make a run with the first variant of an experiment; return its report."""
    return run_virtual(experiment, experiment.variants[0], 1, lambda _now, _ended: None).report


def states(report):
    return {task["id"]: task["state"] for task in report["tasks"]}


def test_a_run_on_virtual_time_gives_the_same_report_again(mine):
    first, again = (virtual(mine("loss: 0.2\n")) for _ in range(2))

    assert first["all_done"]
    assert first["tasks"] == again["tasks"]
    assert first["robots"] == again["robots"]
    assert sum(robot["distance"] for robot in first["robots"]) > 1.0
    assert all(robot["energy"] > 0 for robot in first["robots"])


@pytest.mark.parametrize("architecture", ARCHITECTURES)
def test_every_architecture_does_all_tasks_and_tells_who_has_done_them(mine, architecture):
    report = virtual(mine(f"architectures: [{architecture}]\n"))

    assert report["all_done"]
    assert report["done_twice"] == 0
    assert {task["robot"] for task in report["tasks"]} == {"robot1", "robot2"}
    assert all(task["posted"] <= task["started"] < task["ended"] for task in report["tasks"])
    assert all(0.5 < robot["charge_at_end"] < 1.0 for robot in report["robots"])
    assert all(0.1 < robot["busy_share"] <= 1.0 for robot in report["robots"])


def test_a_robot_that_is_killed_does_nothing_more_and_the_other_does_its_task(mine):
    whole = virtual(mine())
    broken = virtual(mine("faults: [{after: 1, kill: robot1}]\n"))

    assert {task["robot"] for task in whole["tasks"]} == {"robot1", "robot2"}
    assert broken["all_done"]
    assert {task["robot"] for task in broken["tasks"]} == {"robot2"}


@pytest.mark.parametrize("architecture", ["hive", "report"])
def test_the_hive_goes_on_when_the_process_of_its_blackboard_is_killed(mine, killed, architecture):
    more = f"architectures: [{architecture}]\nfaults: [{{after: 5, kill: blackboard}}]\n"

    report = virtual(mine(more, LATER))

    assert killed == ["blackboard"]
    assert set(states(report).values()) == {"DONE"}
    assert report["done_twice"] == 0


def test_in_the_contract_net_a_robot_is_killed_that_manages_tasks(mine, killed):
    virtual(mine("architectures: [contract_net]\nfaults: [{after: 5, kill: blackboard}]\n"))

    assert len(killed) == 1
    assert killed[0] in {"robot1", "robot2"}


def test_a_dispatcher_that_is_killed_takes_no_more_tasks_and_they_count_from_their_posting(mine):
    faults = "faults: [{after: 5, kill: blackboard}]\ntime_limit: 60\n"

    result = virtual(mine(f"architectures: [central]\n{faults}", LATER))

    assert states(result) == {"A": "DONE", "B": "DONE", "C": "WAITING", "D": "WAITING"}
    assert [task["posted"] for task in result["tasks"]] == [0.0, 2.0, 14.0, 14.0]


def test_the_time_until_somebody_takes_a_task_counts(mine):
    frozen = "architectures: [central]\nfaults: [{after: 5, freeze: blackboard, seconds: 30}]\n"

    report = virtual(mine(frozen, LATER))

    assert report["all_done"]
    assert all(task["started"] >= 35.0 for task in report["tasks"][2:])
    assert all(task["waiting"] > 20.0 for task in report["tasks"][2:])


def test_a_robot_whose_process_stands_still_drives_on_and_reports_afterwards(mine):
    usual = virtual(mine())
    frozen = virtual(mine("faults: [{after: 1, freeze: robot1, seconds: 4}]\n"))

    first, then = (report["tasks"][0] for report in (usual, frozen))
    assert first["robot"] == then["robot"] == "robot1"
    assert frozen["all_done"]
    assert frozen["done_twice"] == 0
    assert first["ended"] < 5.0 <= then["ended"] < 7.0


def test_no_task_is_lost_where_one_message_in_five_is(mine):
    whole, report = virtual(mine("", LATER)), virtual(mine("loss: 0.2\n", LATER))

    assert report["tasks"] != whole["tasks"]
    assert report["all_done"]
    assert report["done_twice"] == 0


def test_the_parts_of_a_heavy_task_are_followed(mine, monkeypatch):
    parts, learn = set(), Ledger.learn_parts

    def noted(ledger, tasks):
        tasks = list(tasks)
        parts.update(task.id for task in tasks)
        learn(ledger, tasks)

    monkeypatch.setattr(Ledger, "learn_parts", noted)
    heavy = "  - {id: H, type: GAB, goals: [[3.4, 2.2], [3.4, 3.6]], payload: 130}\n"

    report = virtual(mine("", heavy))

    assert report["all_done"]
    assert len(parts) > 1
    assert all(name.startswith("H.") for name in parts)


def test_a_robot_that_stands_at_a_charger_charges(mine):
    experiment = mine()
    fleet = experiment.fleet_of(experiment.variants[0])
    docked = evolve(fleet.robots[0], pose=load_world("lab").chargers[0].pose)
    fleet = evolve(fleet, robots=(docked, fleet.robots[1]))
    trial = SimulatedTrial(fleet, experiment.scenario_of(1), 1, 0.0)
    first, second = (robot.body.battery for robot in trial.robots.values())
    for battery in (first, second):
        battery.drop_to(0.5)

    trial.network.run(30.0)

    assert first.level > 0.5 > second.level
    assert first.measured.level == first.level
