# SPDX-License-Identifier: BSD-3-Clause
"""Fleets on virtual time, and the benchmarks that are made of them."""

import importlib
import itertools
import math

import numpy as np
import pytest
from attrs import evolve

from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.config.fleet_file import read_fleet
from fleet_manager.config.load import ROOM, random_tasks
from hive_common.pose import Pose
from hive_lab.bench.charge import Ledger
from hive_lab.bench.day import APART, LOOK, Day, draw_day, live
from hive_lab.fleets.reckoned_bodies import ReckonedBodies
from hive_lab.fleets.virtual_fleet import VirtualFleet

LAB = read_fleet("lab")
ONE = evolve(LAB, robots=LAB.robots[:1], decision="distributed")
GO = Task("T1", TaskType.GA, (Pose(8.0, 4.0, 0.0),))


def fleet(robots=ONE, seed=1):
    return VirtualFleet(robots, "lab", ReckonedBodies(np.random.default_rng(seed)), {})


def test_a_reckoned_robot_does_a_task_and_its_battery_pays_for_it():
    run = fleet()
    ledger = Ledger(run)
    run.watch(ledger.note)

    run.post(GO)
    run.run(60.0)

    assert run.updates["T1"][-1].state is TaskState.DONE
    assert run.statuses["robot1"].pose == GO.goals[0]
    assert ledger.used["T1"] > 0.0
    assert ledger.errors(0, 1) == [ledger.predicted["T1"] / ledger.used["T1"] - 1.0]


def test_what_was_said_is_not_kept_for_a_day():
    run = fleet()

    run.run(30.0)

    assert run.network.heard == run.network.sent == []


def test_random_tasks_are_of_all_types_and_the_same_again_with_room_around_their_goals():
    grid = fleet().grid
    keep_off = Pose(3.0, 3.0)
    first, again = (
        list(itertools.islice(random_tasks(grid, np.random.default_rng(2), [keep_off]), 40))
        for _ in range(2)
    )

    assert first == again
    assert {task.type for task in first} == set(TaskType)
    steps = round(ROOM / grid.resolution) - 1
    for goal in itertools.chain.from_iterable(task.goals for task in first):
        row, column = grid.cell(goal)
        near = grid.blocked[row - steps : row + steps + 1, column]
        assert not near.any()
        assert goal.distance_to(keep_off) > 1.4


def test_a_part_of_a_day_leaves_nothing_undone():
    day = live(hours=2.5 * APART / 3600.0)

    assert len(day.posted) == len(day.waited) == 3
    assert not day.stranded
    assert all(0.0 < waited < 200.0 for waited in day.waited.values())
    assert set(day.statuses) == {robot.name for robot in LAB.robots}


def said(state, charge=0.5, reason=""):
    return RobotStatus("robot1", state, Pose(0.0, 0.0), charge, reason=reason)


def test_a_day_counts_a_robot_that_stands_with_an_empty_battery_once():
    day = Day(1.0)

    for _ in range(3):
        day.note(said(RobotState.DEFECT, 0.0, "stranded"))
    day.note(said(RobotState.BUSY))

    assert len(day.stranded) == 1
    assert day.share("robot1", RobotState.BUSY) == pytest.approx(0.25)


def test_a_day_is_drawn(tmp_path):
    day = Day(4 * LOOK / 3600.0)
    for state in (RobotState.IDLE, RobotState.BUSY, RobotState.CHARGING, RobotState.BUSY):
        day.note(said(state))

    draw_day(tmp_path / "day.png", day)

    assert (tmp_path / "day.png").read_bytes().startswith(b"\x89PNG")


def test_a_robot_in_the_simulator_does_a_task_with_its_own_navigation():
    pytest.importorskip("ompl")
    simulated = importlib.import_module("hive_lab.fleets.simulated_bodies")
    bodies = simulated.SimulatedBodies("lab", seed=1)
    run = VirtualFleet(ONE, "lab", bodies, {})
    run.post(Task("T1", TaskType.GA, (Pose(4.5, 2.0, 0.0),)))

    run.run(15.0)

    assert run.updates["T1"][-1].state is TaskState.DONE
    assert math.dist(bodies.simulation.poses["robot1"][:2], (4.5, 2.0)) < 0.2
    assert bodies.simulation.collisions == 0
