# SPDX-License-Identifier: BSD-3-Clause
"""The hive's tasks and robots as text tables and as data for JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from blackboard.domain.bid import ranked
from blackboard.domain.task import TaskState, TaskType
from fleet_manager.client.bids import predicted_by, task_alone
from fleet_manager.client.formats import UNKNOWN, duration, member, natural
from fleet_manager.client.leadership import Standing
from fleet_manager.client.traffic import place_rows, wait_rows

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from blackboard.auction.decision import Decision
    from blackboard.domain.bid import Bid
    from blackboard.domain.characteristics import RobotStatus
    from fleet_manager.client.hive_state import HiveState
    from fleet_manager.client.rows import RobotRow, TaskRow
    from fleet_manager.client.traffic import TrafficState
    from hive_common.map_id import MapId
    from hive_common.pose import Pose

_TASK_HEAD = ("TASK", "TYPE", "PRIO", "LOAD", "STATE", "ROBOT", "STEP", "DONE IN", "REASON")
_BID_HEAD = (
    *("ROBOT", "COST", "WAY", "PLACE", "ENERGY", "LEFT", "DONE IN"),
    *("TASK ALONE", "PREDICTED BY", "REASON"),
)
_PART_HEAD = ("PART", "ROBOT", "REASON")
_WAIT_HEAD = ("ROBOT", "WAITS FOR", "PLACE", "FOR")
_SLOW_HEAD = ("SLOW PLACE", "WHERE", "WAITED", "WAITS")
_MAP_HEAD = ("ROBOT", "MAP", "CHECKSUM", "")
_ROBOT_HEAD = ("ROBOT", "STATE", "BATTERY", "LOAD", "PLACE", "TASK", "QUEUE", "REASON")


def tasks_table(rows: Iterable[TaskRow], now: float, robots: Mapping[str, RobotRow]) -> list[str]:
    """Return a table of tasks with a line of headings.

    Args:
        rows: The tasks.
        now: The hive's time [s].
        robots: The robots that are known, by name.
    """
    return aligned(_TASK_HEAD, [_task_row(row, now, reason(row, robots)) for row in rows])


def _task_row(row: TaskRow, now: float, why: str) -> tuple[str, ...]:
    record = row.record
    return (
        record.task.id,
        TaskType(record.task.type).name,
        str(record.task.priority),
        f"{record.task.payload:g} kg",
        record.state.name,
        record.robot or UNKNOWN,
        f"{record.step}/{record.steps}",
        done_in(row, now),
        why,
    )


def done_in(row: TaskRow, now: float) -> str:
    """Return in how long a task is predicted to be done, or how late it is.

    Args:
        row: The task.
        now: The hive's time [s]; 0 where unknown.
    """
    left = row.due - now if row.due is not None and now > 0 else None
    if left is None or left >= -1:
        return duration(left)
    if row.record.state is TaskState.ASSIGNED:
        return UNKNOWN  # more urgent tasks have come before it since the prediction
    return f"late by {duration(-left)}"


def reason(row: TaskRow, robots: Mapping[str, RobotRow]) -> str:
    """Return why a task does not get on: its own reason, else that of the robot that does it."""
    record = row.record
    robot = robots.get(record.robot) if record.state is TaskState.STARTED else None
    if robot is None or not robot.reason:
        return record.reason
    return "; ".join(filter(None, [record.reason, f"{record.robot}: {robot.reason}"]))


def age(row: TaskRow, now: float) -> str:
    """Return how long ago a task was posted; `now` is the hive's time [s]."""
    # A task can be from before the clock was set back, as it is when a simulation starts again.
    posted = row.record.task.posted
    return duration(now - posted if 0 < posted <= now + 1 else None)


def robots_table(rows: Iterable[RobotRow]) -> list[str]:
    """Return a table of robots with a line of headings."""
    return aligned(_ROBOT_HEAD, [_robot_row(row) for row in rows])


def _robot_row(row: RobotRow) -> tuple[str, ...]:
    robot = row.status
    return (
        robot.robot_id,
        row.state.name,
        f"{robot.charge:.0%}",
        f"{robot.payload:g} kg",
        f"{robot.pose.x:.1f}, {robot.pose.y:.1f}",
        robot.task_id or UNKNOWN,
        str(queued(robot)),
        row.reason,
    )


def maps_table(used: Mapping[str, MapId], leaders: MapId | None) -> list[str]:
    """Return a table of the maps that robots use, and which is not the leader's."""
    rows = []
    for robot, each in used.items():
        is_odd = leaders is not None and each.differs(leaders)
        remark = "not the leader's: gets no tasks" if is_odd else ""
        rows.append((robot, each.name or UNKNOWN, each.checksum or UNKNOWN, remark))
    return aligned(_MAP_HEAD, rows)


def waits_table(state: TrafficState) -> list[str]:
    """Return a table of the robots that wait, the longest first."""
    return aligned(_WAIT_HEAD, wait_rows(state))


def slow_places_table(state: TrafficState) -> list[str]:
    """Return a table of the places where robots have waited, the slowest first."""
    return aligned(_SLOW_HEAD, place_rows(state))


def bids_table(bids: Iterable[Bid]) -> list[str]:
    """Return a table of the bids on one task, the cheapest first."""
    return aligned(_BID_HEAD, [_bid_row(bid) for bid in ranked(bids)])


def _bid_row(bid: Bid) -> tuple[str, ...]:
    terms, alone = bid.terms, (task_alone(bid), predicted_by(bid))
    if not bid.is_able or terms is None:
        known = f"{bid.cost:.2f}" if bid.is_able else UNKNOWN
        return (bid.robot_id, known, *[UNKNOWN] * 5, *alone, bid.reason)
    return (
        bid.robot_id,
        f"{bid.cost:.2f}",
        f"{terms.way:.1f} m",
        str(terms.place),
        f"{terms.energy_charge:.3f} Ah",
        f"{terms.charge_left:.1f} Ah",
        f"{terms.eta:.0f} s",
        *alone,
        bid.reason,
    )


def decided(decision: Decision) -> str:
    """Return in words what an auction decided about a task."""
    reason = f" ({decision.reason})" if decision.reason else ""
    what = f"was given to {decision.winner}{reason}" if decision.winner else decision.reason
    silent = f"; no answer from {', '.join(decision.silent)}" if decision.silent else ""
    number = f"auction {decision.epoch}/{decision.auction}, round {decision.round}"
    return f"{decision.task_id} at {decision.at:.1f} s, {number}: {what}{silent}"


def parts_table(decisions: Mapping[str, Decision]) -> list[str]:
    """Return a table of the parts of a task, each with the last decision on it."""
    rows = [
        (part, decision.winner or UNKNOWN, decision.reason) for part, decision in decisions.items()
    ]
    return aligned(_PART_HEAD, rows)


def who_leads(state: HiveState, wall: float, now: float) -> str:
    """Return in words who is the leader, and how old the task list is where nobody is.

    Args:
        state: What is known of the hive.
        wall: The present time [s, wall].
        now: The hive's time [s].
    """
    beat, standing = state.heartbeat, state.leadership.standing(wall)
    if standing is Standing.LEADER and beat is not None:
        backup = member(beat.backup) or "nobody"
        return f"{member(beat.leader)} is the leader (epoch {beat.epoch}), {backup} its backup"
    if standing is Standing.STUCK and beat is not None:
        who = f"no leader: {member(beat.leader)} answers but does not work"
    elif beat is not None:
        silence = duration(state.leadership.silence(wall))
        who = f"no leader: {member(beat.leader)} has been silent for {silence}"
    else:
        who = "no leader is heard"
    if not state.has_list:
        return who
    old = f", {duration(now - state.list_stamp)} old" if 0 < state.list_stamp <= now else ""
    return f"{who}; tasks wait. The list is the last one that is known{old}"


def robots_of(state: HiveState) -> list[RobotRow]:
    """Return the robots, sorted by name."""
    return [state.robots[name] for name in sorted(state.robots, key=natural)]


def queued(robot: RobotStatus) -> int:
    """Return the number of tasks in a robot's queue behind its current one."""
    return sum(task_id != robot.task_id for task_id in robot.tasks)


def task_data(row: TaskRow, now: float) -> dict[str, Any]:
    """Return a task as plain data; lengths in m, angles in rad, loads in kg, times in s.

    `now` is the hive's time [s], from which `eta` counts; it is negative where the task is late,
    and 0 where unknown.
    """
    record = row.record
    return {
        "id": record.task.id,
        "type": TaskType(record.task.type).name,
        "priority": record.task.priority,
        "payload": record.task.payload,
        "no_split": record.task.no_split,
        "goals": [_pose_data(goal) for goal in record.task.goals],
        "state": record.state.name,
        "robot": record.robot,
        "step": record.step,
        "steps": record.steps,
        "posted": record.task.posted,
        "eta": 0.0 if row.due is None or now <= 0 else row.due - now,
        "reason": record.reason,
        "parent": record.parent,
    }


def robot_data(row: RobotRow) -> dict[str, Any]:
    """Return a robot as plain data; lengths in m, angles in rad, loads in kg, charge 0..1.

    `carries` has the maximum load for each type of task, -1 if the robot does no such task.
    """
    robot = row.status
    return {
        "name": robot.robot_id,
        "state": row.state.name,
        "pose": _pose_data(robot.pose),
        "charge": robot.charge,
        "payload": robot.payload,
        "task": robot.task_id,
        "queued": queued(robot),
        "tasks": list(robot.tasks),
        "carries": {
            kind.name: most for kind in TaskType if (most := robot.most_payload(kind)) is not None
        },
        "map": robot.map._asdict(),
        "reason": row.reason,
    }


def fit(lines: Iterable[str], width: int) -> list[str]:
    """Return the lines, the long ones cut to a width with an ellipsis."""
    return [line if len(line) <= width else line[: max(width - 1, 0)] + "…" for line in lines]


def _pose_data(pose: Pose) -> dict[str, float]:
    return {"x": pose.x, "y": pose.y, "yaw": pose.yaw}


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return lines with aligned columns; the last column has no limit."""
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    lines = (
        "  ".join(cell.ljust(w) for cell, w in zip(r, widths, strict=True)) for r in (head, *rows)
    )
    return [line.rstrip() for line in lines]
