# SPDX-License-Identifier: BSD-3-Clause
"""The checker follows each load, also where two tasks have had the same id."""

import pytest

from blackboard.domain.task import StepKind, TaskStep
from hive_common.pose import Pose
from hive_lab.fault_schedules.history import Violation
from hive_lab.fault_schedules.simulated_arm import LoadChecker


class Bench:
    """A checker that raises."""

    def __init__(self):
        self.checker = LoadChecker(self.broken)

    def broken(self, which, what):
        """Raise."""
        raise Violation(f"{which}: {what}")

    def pick(self, robot, action="hive1/T1/1/1"):
        """Let a robot pick for T1."""
        self.checker.pick(robot, step(StepKind.PICK, action), "")

    def put_down(self, robot, action="hive1/T1/1/2"):
        """Let a robot put the load of T1 down."""
        self.checker.put_down(robot, step(StepKind.PLACE, action))


def step(kind, action):
    """Return a step for T1 that the arm is asked for under an id."""
    return TaskStep(kind, Pose(0.0, 0.0), 2.0, "T1", action=action)


def test_a_load_that_two_robots_pick_is_noticed():
    bench = Bench()
    bench.pick("robot1")

    with pytest.raises(Violation, match="robot2 picks a load of T1, which robot1 has picked"):
        bench.pick("robot2", "hive1/T1/2/1")


def test_a_load_that_another_robot_puts_down_is_noticed():
    bench = Bench()
    bench.pick("robot1")

    with pytest.raises(Violation, match="robot2 puts a load of T1 down that is not on board"):
        bench.put_down("robot2")


def test_a_task_posted_anew_has_a_load_of_its_own():
    bench = Bench()
    bench.checker.begin_anew("T1", "hive1", 3)
    bench.pick("robot4", "hive1/T1/4/1")

    bench.pick("robot3", "hive1/T1/1/1")
    bench.put_down("robot4", "hive1/T1/4/2")

    bench.checker.check_done("T1", "hive1", 5)
    with pytest.raises(Violation, match="T1 is done, and its load was put down 0 times"):
        bench.checker.check_done("T1", "hive1", 3)


def test_the_load_of_a_task_posted_anew_is_followed_like_any_other():
    bench = Bench()
    bench.pick("robot1")
    bench.checker.begin_anew("T1", "hive1", 3)
    bench.pick("robot1", "hive1/T1/4/1")

    with pytest.raises(Violation, match="robot2 picks a load of T1, which robot1 has picked"):
        bench.pick("robot2", "hive1/T1/5/1")


@pytest.mark.parametrize(
    ("action", "is_earlier"),
    [
        ("hive1/T1/3/1", True),
        ("hive1/T1/4/1", False),
        ("hive2/T1/1/1", False),
        ("", False),
    ],
)
def test_the_assignment_tells_the_step_of_a_forgotten_task(action, is_earlier):
    bench = Bench()
    bench.checker.begin_anew("T1", "hive1", 3)

    assert bench.checker.is_of_an_earlier_task(step(StepKind.PICK, action)) == is_earlier
