# SPDX-License-Identifier: BSD-3-Clause
"""A run is over when each task has ended, or when only a person could help it."""

from types import SimpleNamespace

import pytest

from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.fault_schedules.ending import Ending
from hive_lab.fault_schedules.history import Violation

CHARGERS = {"north": Pose(0.0, 0.0), "south": Pose(5.0, 0.0)}


class FakeRobot:
    """A robot of hive1 that stands somewhere; what `Ending` reads of a simulated member."""

    def __init__(self, at, level=0.5, *, chargers=CHARGERS, able=True, gone=False):
        self.pose, self.gone = at, gone
        self.battery = SimpleNamespace(level=level)
        self.drive = object()
        self.kit = SimpleNamespace(
            charging=SimpleNamespace(chargers=chargers),
            characteristics=SimpleNamespace(excludes=lambda _task: "" if able else "too heavy"),
        )
        self.board = SimpleNamespace(on_robot_lost="reassign")
        self.disk = SimpleNamespace(hard_state=SimpleNamespace(hive="hive1"), reports=())
        self.host = SimpleNamespace(up=False, warnings=())


def ending_of(*robots, state=TaskState.WAITING, robot=""):
    """Return the end of a run with one task, T1."""

    def broken(which, what):
        raise Violation(f"{which}: {what}")

    record = TaskRecord(Task("T1", TaskType.GA, (Pose(2.0, 2.0),)), state, robot)
    hives = {"hive1": SimpleNamespace(truth={"T1": record}, forgotten={})}
    members = {f"robot{number}": each for number, each in enumerate(robots, start=1)}
    return Ending(members, hives, ["T1"], broken)


def gone(at):
    return FakeRobot(at, gone=True)


def test_a_task_that_a_robot_could_do_is_not_over():
    ending = ending_of(FakeRobot(Pose(1.0, 0.0)))

    assert not ending.is_over()
    with pytest.raises(Violation, match="it goes on: T1 is WAITING"):
        ending.check()


def test_a_task_is_over_that_only_an_empty_robot_could_do_whose_chargers_gone_robots_hold():
    empty = FakeRobot(Pose(1.0, 0.0), level=0.0)

    ending_of(empty, *map(gone, CHARGERS.values())).check()


@pytest.mark.parametrize(
    "robot",
    [
        FakeRobot(Pose(1.0, 0.0), level=0.1),
        FakeRobot(Pose(1.0, 0.0), level=0.0, chargers={**CHARGERS, "west": Pose(-5.0, 0.0)}),
        FakeRobot(Pose(1.0, 0.0), level=0.0, chargers={}),
    ],
    ids=["can still drive", "one charger is free", "has no chargers"],
)
def test_a_robot_is_not_stranded_which(robot):
    assert not ending_of(robot, *map(gone, CHARGERS.values())).is_over()


def test_a_robot_that_could_come_back_keeps_no_charger_for_good():
    standing = [FakeRobot(at, able=False) for at in CHARGERS.values()]

    assert not ending_of(FakeRobot(Pose(1.0, 0.0), level=0.0), *standing).is_over()


def test_a_task_that_no_robot_can_do_is_over_while_it_waits():
    robot = FakeRobot(Pose(1.0, 0.0), able=False)

    assert ending_of(robot).is_over()
    assert not ending_of(robot, state=TaskState.STARTED, robot="robot1").is_over()
