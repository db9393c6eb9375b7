# SPDX-License-Identifier: BSD-3-Clause
"""The hive's tasks and robots as text tables and as data for JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from blackboard.domain.bid import ranked
from blackboard.domain.task import TaskType
from fleet_manager.client.formats import member
from fleet_manager.client.traffic import place_rows, wait_rows

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from blackboard.auction.decision import Decision
    from blackboard.domain.bid import Bid
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import TaskRecord
    from fleet_manager.client.hive_state import HiveState
    from fleet_manager.client.traffic import TrafficState
    from hive_common.pose import Pose

_TASK_HEAD = ("TASK", "TYPE", "PRIO", "LOAD", "STATE", "ROBOT", "STEP", "ETA", "REASON")
_BID_HEAD = ("ROBOT", "COST", "WAY", "PLACE", "ENERGY", "LEFT", "DONE IN", "REASON")
_WAIT_HEAD = ("ROBOT", "WAITS FOR", "PLACE", "FOR")
_SLOW_HEAD = ("SLOW PLACE", "WHERE", "WAITED", "WAITS")
_ROBOT_HEAD = ("ROBOT", "STATE", "BATTERY", "LOAD", "PLACE", "TASK", "QUEUE", "REASON")


def tasks_table(records: Iterable[TaskRecord]) -> list[str]:
    """Return a table of tasks with a line of headings."""
    rows = [
        (
            record.task.id,
            TaskType(record.task.type).name,
            str(record.task.priority),
            f"{record.task.payload:g} kg",
            record.state.name,
            record.robot or "-",
            f"{record.step}/{record.steps}",
            "-" if record.state.is_terminal or record.eta <= 0 else f"{record.eta:.0f} s",
            record.reason,
        )
        for record in records
    ]
    return _table(_TASK_HEAD, rows)


def robots_table(robots: Iterable[RobotStatus]) -> list[str]:
    """Return a table of robots with a line of headings."""
    rows = [
        (
            robot.robot_id,
            robot.state.name,
            f"{robot.charge:.0%}",
            f"{robot.payload:g} kg",
            f"{robot.pose.x:.1f}, {robot.pose.y:.1f}",
            robot.task_id or "-",
            str(queued(robot)),
            robot.reason,
        )
        for robot in robots
    ]
    return _table(_ROBOT_HEAD, rows)


def waits_table(state: TrafficState) -> list[str]:
    """Return a table of the robots that wait, the longest first."""
    return _table(_WAIT_HEAD, wait_rows(state))


def slow_places_table(state: TrafficState) -> list[str]:
    """Return a table of the places where robots have waited, the slowest first."""
    return _table(_SLOW_HEAD, place_rows(state))


def bids_table(bids: Iterable[Bid]) -> list[str]:
    """Return a table of the bids on one task, the cheapest first."""
    return _table(_BID_HEAD, [_bid_row(bid) for bid in ranked(bids)])


def _bid_row(bid: Bid) -> tuple[str, ...]:
    terms = bid.terms
    if not bid.is_able or terms is None:
        known = f"{bid.cost:.2f}" if bid.is_able else "-"
        return (bid.robot_id, known, "-", "-", "-", "-", "-", bid.reason)
    return (
        bid.robot_id,
        f"{bid.cost:.2f}",
        f"{terms.way:.1f} m",
        str(terms.place),
        f"{terms.energy_charge:.3f} Ah",
        f"{terms.charge_left:.1f} Ah",
        f"{terms.eta:.0f} s",
        bid.reason,
    )


def decided(decision: Decision) -> str:
    """Return in words what an auction decided about a task."""
    reason = f" ({decision.reason})" if decision.reason else ""
    what = f"was given to {decision.winner}{reason}" if decision.winner else decision.reason
    silent = f"; no answer from {', '.join(decision.silent)}" if decision.silent else ""
    number = f"auction {decision.epoch}/{decision.auction}, round {decision.round}"
    return f"{decision.task_id} at {decision.at:.1f} s, {number}: {what}{silent}"


def who_leads(state: HiveState) -> str:
    """Return in words who carries the blackboard."""
    beat = state.heartbeat
    if beat is None:
        return "no blackboard is heard"
    backup = member(beat.backup) or "nobody"
    leads = f"{member(beat.leader)} carries the blackboard (epoch {beat.epoch})"
    return f"{leads}, {backup} is its backup"


def robots_of(state: HiveState) -> list[RobotStatus]:
    """Return the robots, sorted by name."""
    return [state.robots[name].status for name in sorted(state.robots)]


def queued(robot: RobotStatus) -> int:
    """Return the number of tasks in a robot's queue behind its current one."""
    return sum(task_id != robot.task_id for task_id in robot.tasks)


def task_data(record: TaskRecord) -> dict[str, Any]:
    """Return a task as plain data; lengths in m, angles in rad, loads in kg, times in s."""
    return {
        "id": record.task.id,
        "type": TaskType(record.task.type).name,
        "priority": record.task.priority,
        "payload": record.task.payload,
        "goals": [_pose_data(goal) for goal in record.task.goals],
        "state": record.state.name,
        "robot": record.robot,
        "step": record.step,
        "steps": record.steps,
        "eta": record.eta,
        "reason": record.reason,
        "parent": record.parent,
    }


def robot_data(robot: RobotStatus) -> dict[str, Any]:
    """Return a robot as plain data; lengths in m, angles in rad, loads in kg, charge 0..1."""
    return {
        "name": robot.robot_id,
        "state": robot.state.name,
        "pose": _pose_data(robot.pose),
        "charge": robot.charge,
        "payload": robot.payload,
        "task": robot.task_id,
        "queued": queued(robot),
        "tasks": list(robot.tasks),
        "reason": robot.reason,
    }


def fit(lines: Iterable[str], width: int) -> list[str]:
    """Return the lines, the long ones cut to a width with an ellipsis."""
    return [line if len(line) <= width else line[: max(width - 1, 0)] + "…" for line in lines]


def _pose_data(pose: Pose) -> dict[str, float]:
    return {"x": pose.x, "y": pose.y, "yaw": pose.yaw}


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return lines with aligned columns; the last column has no limit."""
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    lines = (
        "  ".join(cell.ljust(w) for cell, w in zip(r, widths, strict=True)) for r in (head, *rows)
    )
    return [line.rstrip() for line in lines]
