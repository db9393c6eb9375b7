# SPDX-License-Identifier: BSD-3-Clause
"""What a new map brings with it: where robots stand, and what they no longer reach."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from blackboard.costing.grid_path_lengths import GridPathLengths
from fleet_manager.client.formats import natural
from fleet_manager.client.traffic import out_of_reach

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from blackboard.domain.record import TaskRecord
    from hive_common.grid_map import GridMap
    from hive_common.pose import Pose


class PlacedRobot(NamedTuple):
    """A robot where it stands."""

    name: str
    pose: Pose  # map frame
    radius: float  # how close its middle may come to what is blocked [m]


def of_changing_map(
    grid: GridMap,
    robots: Sequence[PlacedRobot],
    places: Mapping[str, Pose],
    records: Iterable[TaskRecord],
) -> list[str]:
    """Return what using another map brings with it; nothing if all stays within reach.

    Args:
        grid: The other map.
        robots: Those that are to use it.
        places: The named places of the building, map frame.
        records: The tasks on the list.
    """
    grid = grid.free_or_blocked()
    ways = {robot.radius: GridPathLengths(grid, robot.radius) for robot in robots}

    def reached_by(robot: PlacedRobot, pose: Pose) -> bool:
        return ways[robot.radius].reaches(robot.pose, pose)

    lines, standing = [], []
    for robot in sorted(robots, key=lambda each: natural(each.name)):
        refusal = grid.refusal(robot.pose)
        if refusal:
            x, y, _ = robot.pose
            lines.append(f"{robot.name} stands at ({x:.2f}, {y:.2f}), which {refusal}")
        else:
            standing.append(robot)
    missed = {
        robot.name: [name for name, pose in places.items() if not reached_by(robot, pose)]
        for robot in standing
    }
    lines += out_of_reach(missed)
    for record in records:
        if record.state.is_terminal or record.parts:
            continue
        goals = [
            f"({goal.x:.2f}, {goal.y:.2f})"
            for goal in record.task.goals
            if not any(reached_by(robot, goal) for robot in standing)
        ]
        if goals and standing:
            lines.append(f"no robot reaches {' and '.join(goals)} of task {record.task.id}")
    return lines
