# SPDX-License-Identifier: BSD-3-Clause
"""Makes the report of a run from its history, as data for JSON."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from blackboard.domain.task import TaskState, TaskType
from fleet_manager.demo.history import RobotTrack, TaskTimes

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.domain.task import Task
    from fleet_manager.client.hive_state import HiveState
    from fleet_manager.config.fleet_file import Fleet
    from fleet_manager.config.scenario import Scenario
    from fleet_manager.demo.history import History

_HOUR = 3600.0  # [s]

UNITS = {
    "length": "m",
    "angle": "rad",
    "time": "s, the hive's clock, from the first posting",
    "mass": "kg",
    "charge": "0..1",
    "energy": "J",
    "memory": "GB",
}


@dataclass(frozen=True)
class Clocks:
    """The times of a run."""

    date: str  # of its start, ISO 8601
    asked_rtf: float  # the requested real-time factor
    hive: float  # its length [s, hive's time]
    wall: float  # its length [s, wall]

    @property
    def reached_rtf(self) -> float:
        """The real-time factor that was reached."""
        return self.hive / self.wall if self.wall > 0 else 0.0


def make_report(
    scenario: Scenario, fleet: Fleet, state: HiveState, history: History, clocks: Clocks
) -> dict[str, Any]:
    """Return the report of a run, from the hive at its end and the closed history."""
    tasks = [_task_entry(planned.task, state, history) for planned in scenario.tasks]
    robots = [
        _robot_entry(robot.name, robot.model, tasks, history, clocks.hive)
        for robot in fleet.robots
    ]
    return {
        "scenario": scenario.name,
        "description": scenario.description,
        "world": scenario.world,
        "fleet": fleet.path.stem,
        "cost_model": fleet.cost_model,
        "distance": fleet.distance,
        "date": clocks.date,
        "all_done": all(task["state"] == "DONE" for task in tasks),
        "done": sum(task["state"] == "DONE" for task in tasks),
        "collisions": history.collisions,
        "time": {
            "hive": round(clocks.hive, 1),
            "wall": round(clocks.wall, 1),
            "real_time_factor_asked": clocks.asked_rtf,
            "real_time_factor_reached": round(clocks.reached_rtf, 2),
        },
        "summary": _summary(tasks, robots, clocks.hive),
        "tasks": tasks,
        "robots": robots,
        "units": UNITS,
    }


def not_done(report: Mapping[str, Any]) -> list[str]:
    """Return a line for each task of a report that is not DONE, with the reason."""
    return [
        f"{task['id']} {task['state']}" + (f": {task['reason']}" if task["reason"] else "")
        for task in report["tasks"]
        if task["state"] != "DONE"
    ]


def _task_entry(task: Task, state: HiveState, history: History) -> dict[str, Any]:
    """Return one task's part of the report."""
    record, known = state.record(task.id), state.last_word(task.id)
    times = history.tasks.get(task.id, TaskTimes())
    return {
        "id": task.id,
        "type": TaskType(task.type).name,
        "priority": task.priority,
        "payload": task.payload,
        "goals": [{"x": goal.x, "y": goal.y, "yaw": goal.yaw} for goal in task.goals],
        "state": known.state.name if known else TaskState.WAITING.name,
        "robot": record.robot if record else "",
        "reason": known.reason if known else "it was never posted",
        "posted": _rounded(times.posted),
        "assigned": _rounded(times.assigned),
        "started": _rounded(times.started),
        "ended": _rounded(times.ended),
        "waiting": _between(times.posted, times.started),
        "duration": _between(times.started, times.ended),
    }


def _robot_entry(
    name: str, model: str, tasks: list[dict[str, Any]], history: History, length: float
) -> dict[str, Any]:
    """Return one robot's part of the report."""
    track = history.tracks.get(name, RobotTrack())
    charges = [charge for _, charge in track.charges]
    busy = sum((s.end or length) - s.begin for s in history.spans if s.robot == name)
    return {
        "name": name,
        "model": model,
        "done": sum(task["robot"] == name and task["state"] == "DONE" for task in tasks),
        "distance": round(track.distance, 1),
        "energy": round(track.energy),
        "charge_at_start": charges[0] if charges else None,
        "charge_at_end": charges[-1] if charges else None,
        "busy_share": round(busy / length, 2) if length > 0 else 0.0,
    }


def _summary(
    tasks: list[dict[str, Any]], robots: list[dict[str, Any]], length: float
) -> dict[str, float | None]:
    """Return the figures of a whole run of a length [s]; None where nothing was done."""
    waits = [task["waiting"] for task in tasks if task["waiting"] is not None]
    shares = [robot["busy_share"] for robot in robots]
    done = sum(task["state"] == "DONE" for task in tasks)
    return {
        "tasks_per_hour": round(done * _HOUR / length, 1) if length > 0 else None,
        "mean_waiting": round(sum(waits) / len(waits), 1) if waits else None,
        "longest_waiting": max(waits, default=None),
        "utilization": round(sum(shares) / len(shares), 2) if shares else None,
    }


def _rounded(time: float | None) -> float | None:
    return None if time is None else round(time, 1)


def _between(begin: float | None, end: float | None) -> float | None:
    return None if begin is None or end is None else round(end - begin, 1)
