# SPDX-License-Identifier: BSD-3-Clause
"""Robots that measure their batteries, and what their batteries really have."""

import pytest

pytest.importorskip("ompl")

from attrs import evolve

from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.config.fleet_file import read_fleet
from hive_common.pose import Pose
from hive_lab.fleets.simulated_bodies import SimulatedBodies
from hive_lab.fleets.virtual_fleet import VirtualFleet

LAB = read_fleet("lab")
ARM = next(robot for robot in LAB.robots if robot.model == "fetch")
GO = Task("T1", TaskType.GA, (Pose(4.5, 2.0, 0.0),))
X, Y, _ = ARM.pose
CARRY = Task("T1", TaskType.GPAB, (Pose(X + 1.0, Y), Pose(X, Y)), payload=0.4)


BASE = LAB.robots[0]
HAUL = Task("T1", TaskType.GAB, (Pose(4.5, 2.0), Pose(2.0, 2.0)), payload=100.0)


def fleet_after(task, robot, seconds, friction=1.0, *, measured=True):
    """Return a fleet of one robot that has done a task."""
    robots = evolve(LAB, robots=(robot,), decision="distributed")
    run = VirtualFleet(robots, "lab", SimulatedBodies("lab", 1), {}, measured=measured)
    if measured:
        run.true_batteries[robot.name].friction = friction
    run.post(task)
    run.run(seconds)
    assert run.updates["T1"][-1].state is TaskState.DONE
    return run


def test_a_robot_measures_what_its_battery_really_has():
    run = fleet_after(CARRY, ARM, 80.0, friction=1.5)
    true = run.true_batteries[ARM.name].level

    assert run.batteries[ARM.name].level == true < 1.0
    assert run.statuses[ARM.name].charge == pytest.approx(true, abs=1e-4)


@pytest.mark.parametrize(("task", "robot"), [(CARRY, ARM), (HAUL, BASE)], ids=["arm", "load"])
def test_a_battery_really_loses_what_a_robot_as_described_reckons(task, robot):
    reckoned, measured = (
        1.0 - fleet_after(task, robot, 80.0, measured=measured).batteries[robot.name].level
        for measured in (False, True)
    )

    assert measured == pytest.approx(reckoned, rel=0.01)


def test_a_worn_wheel_takes_its_share_more_for_the_same_drive():
    still, whole, worn = (
        fleet_after(GO, BASE, 15.0, friction).true_batteries[BASE.name].charge_left
        for friction in (0.0, 1.0, 1.5)
    )

    assert whole < still
    assert still - worn == pytest.approx(1.5 * (still - whole), rel=1e-3)
