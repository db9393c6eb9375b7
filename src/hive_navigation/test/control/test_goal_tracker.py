# SPDX-License-Identifier: BSD-3-Clause
"""A goal ends when it is reached, after too many failed attempts, or without progress."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
import yaml

from hive_common.errors import ParameterError
from hive_common.pose import Pose
from hive_navigation.control.goal_tracker import GoalTracker, NavigationSettings, StuckDetector

SETTINGS = NavigationSettings(attempts=2, patience=5.0, give_up=60.0)
GOAL = Pose(5.0, 0.0, 0.0)


def test_a_goal_fails_after_the_allowed_attempts() -> None:
    tracker = GoalTracker(GOAL, 0.0, SETTINGS)

    assert tracker.attempt_failed(1.0, "no path") is None
    assert tracker.retry_at == 6.0
    assert tracker.attempt_failed(6.0, "no path") is None
    outcome = tracker.attempt_failed(11.0, "no path")

    assert outcome == (False, "no path (given up after 2 attempts)")


def test_after_a_blocked_path_the_robot_plans_again_at_once_around_the_nearest_obstacle() -> None:
    tracker = GoalTracker(GOAL, 0.0, NavigationSettings(attempts=1))
    obstacles = np.array([[4.0, 1.0], [2.0, 1.0]])
    tracker.blocked(1.0, Pose(0.0, 0.0), obstacles)

    outcome = tracker.blocked(2.0, Pose(0.0, 0.0), obstacles)

    assert tracker.retry_at == 2.0
    assert outcome is not None
    assert "blocks the path at (2.00, 1.00)" in outcome.text


def test_a_goal_is_hopeless_without_progress() -> None:
    tracker = GoalTracker(GOAL, 0.0, SETTINGS)
    tracker.update(10.0, 5.0)
    tracker.update(50.0, 4.95)

    assert not tracker.is_hopeless(70.0)
    assert tracker.is_hopeless(70.1)


@pytest.mark.parametrize(
    ("pose", "reached"), [(Pose(5.05, 0.0, 0.05), True), (Pose(5.2, 0.0, 0.0), False)]
)
def test_a_goal_is_reached_within_the_tolerances_only(pose: Pose, reached: bool) -> None:
    outcome = GoalTracker(GOAL, 0.0, NavigationSettings(attempts=1)).stopped_at(1.0, pose)

    assert (outcome is not None and outcome.reached) == reached


def test_a_robot_is_stuck_since_it_last_moved_or_turned() -> None:
    detector = StuckDetector()
    detector.update(1.0, Pose(0.0, 0.0, 0.0))
    detector.update(2.0, Pose(0.06, 0.0, 0.0))
    detector.update(3.0, Pose(0.06, 0.0, 0.2))
    detector.update(9.0, Pose(0.1, 0.0, 0.25))

    assert detector.duration(10.0) == 7.0


def test_a_setting_that_is_not_above_zero_is_rejected() -> None:
    with pytest.raises(ParameterError, match=r"patience: 0\.0; allowed: a number above 0"):
        NavigationSettings(patience=0.0)


def test_the_file_of_move_base_holds_its_defaults() -> None:
    path = Path(__file__).parents[2] / "config" / "move_base.yaml"

    assert yaml.safe_load(path.read_text(encoding="utf-8")) == asdict(NavigationSettings())
