# SPDX-License-Identifier: BSD-3-Clause
"""What a robot is and how it is, as values (the report's table of characteristics)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from blackboard.domain.battery import BatteryModel
from blackboard.domain.task import StepKind, TaskType
from blackboard.errors import CharacteristicsError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.domain.task import Task
    from hive_common.pose import Pose


class RobotState(IntEnum):
    """Whether a robot can be counted on."""

    IDLE = 0
    """In service, nothing to do."""
    BUSY = 1
    """In service, at work."""
    DEFECT = 2
    """Out of service until an operator puts it back."""
    CHARGING = 3
    """Out of service until its battery is full."""
    OFFLINE = 4
    """Not heard from; a robot never says this itself."""

    @property
    def in_service(self) -> bool:
        """Whether it takes tasks."""
        return self in {RobotState.IDLE, RobotState.BUSY}


@dataclass(frozen=True, slots=True)
class RobotCharacteristics:
    """What a robot is, as far as bids need it (the report's table of characteristics).

    Attributes:
        mass: Of the robot alone [kg], above 0.
        payload: What it can carry [kg], at least 0.
        max_speed: [m/s], above 0.
        friction_coefficient: Rolling friction of its wheels on the floor, above 0.
        radius: Of the circle around its base that has to fit through doors [m], above 0.
        battery: What kind of battery it has.
        capabilities: The types of tasks it can do.
        arm_payload: What its arm can lift [kg]; 0 without an arm.
        arm_power: Drawn while the arm works [W], at least 0.
        pick_duration: [s], at least 0.
        place_duration: [s], at least 0.
        idle_power: Drawn all the time [W], at least 0.

    Raises:
        CharacteristicsError: A value is outside its range.
    """

    mass: float
    payload: float
    max_speed: float
    friction_coefficient: float
    radius: float
    battery: BatteryModel
    capabilities: frozenset[TaskType] = field(default_factory=lambda: frozenset(TaskType))
    arm_payload: float = 0.0
    arm_power: float = 0.0
    pick_duration: float = 0.0
    place_duration: float = 0.0
    idle_power: float = 0.0

    def __post_init__(self) -> None:
        for name in ("mass", "max_speed", "friction_coefficient", "radius"):
            self._check(name, getattr(self, name) > 0, "above 0")
        durations = ("pick_duration", "place_duration")
        for name in ("payload", "arm_payload", "arm_power", "idle_power", *durations):
            self._check(name, getattr(self, name) >= 0, "at least 0")

    def _check(self, name: str, allowed: bool, what: str) -> None:
        if not (allowed and math.isfinite(getattr(self, name))):
            raise CharacteristicsError(f"{name} is {getattr(self, name)!r}; allowed: {what}")

    def arm_time(self, kind: StepKind) -> float:
        """Return how long the arm works in a kind of step [s]; 0 in a drive."""
        times = {StepKind.PICK: self.pick_duration, StepKind.PLACE: self.place_duration}
        return times.get(kind, 0.0)

    def most_payload(self, kind: TaskType) -> float:
        """Return its greatest payload in a type of task [kg]; -1 if it can carry nothing."""
        most = min(self.payload, self.arm_payload) if kind.picks else self.payload
        return most if kind in self.capabilities and most > 0 else -1.0

    def excludes(self, task: Task) -> str:
        """Say why the robot can never do a task; empty if it can."""
        kind = TaskType(task.type)
        if kind not in self.capabilities:
            return f"does not do {kind.name}"
        if task.payload > self.payload:
            return f"carries at most {self.payload:g} kg, not {task.payload:g} kg"
        if kind.picks and task.payload > self.arm_payload:
            return f"its arm lifts at most {self.arm_payload:g} kg, not {task.payload:g} kg"
        return ""


def characteristics_from(model: Mapping[str, Any]) -> RobotCharacteristics:
    """Read a robot's description, as `robot_description/models/*.yaml` holds it.

    Raises:
        CharacteristicsError: Something is missing or not allowed; the text names it.
    """
    try:
        base, battery, arm = model["base"], model["battery"], model.get("arm") or {}
        kind = BatteryModel(
            battery["capacity"],
            battery["voltage_full"],
            battery["voltage_empty"],
            battery["charging_time"],
        )
        return RobotCharacteristics(
            mass=base["mass"],
            payload=model["payload"],
            max_speed=base["max_speed"],
            friction_coefficient=base["friction_coefficient"],
            radius=_inscribed_radius(base["footprint"]),
            battery=kind,
            capabilities=frozenset(TaskType[name] for name in model["capabilities"]),
            arm_payload=arm.get("payload", 0.0),
            arm_power=arm.get("power", 0.0),
            pick_duration=arm.get("pick_duration", 0.0),
            place_duration=arm.get("place_duration", 0.0),
            idle_power=battery["idle_power"],
        )
    except KeyError as error:
        raise CharacteristicsError(
            f"the robot's characteristics have no or an unknown {error}; "
            "see docs/adding-a-robot.md for what a model file holds"
        ) from None
    except (AttributeError, TypeError, ValueError) as error:
        raise CharacteristicsError(
            f"the robot's characteristics hold a value of the wrong kind: {error}; "
            "see docs/adding-a-robot.md for what a model file holds"
        ) from None


def _inscribed_radius(footprint: list[list[float]]) -> float:
    """Return the distance from the base to the nearest edge of its convex footprint [m]."""
    corners = np.asarray(footprint, dtype=float)
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([edges[:, 1], -edges[:, 0]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return float(np.min(np.sum(normals * corners, axis=1)))


@dataclass(frozen=True, slots=True)
class RobotStatus:
    """How a robot is (message RobotStatus).

    Attributes:
        robot_id: Its name.
        state: Whether it can be counted on.
        pose: Of its base in the map frame.
        charge: From 0 to 1.
        payload: On board now [kg].
        task_id: What it is doing; empty if nothing.
        reason: Why it is out of service, or stopped with work to do; empty otherwise.
        tasks: Its schedule, in the order it will do them.
        sent: When it was sent, by the robot's own clock [s].
        hive: Id of its hive; empty if it belongs to none yet.
    """

    robot_id: str
    state: RobotState
    pose: Pose
    charge: float
    payload: float = 0.0
    task_id: str = ""
    reason: str = ""
    tasks: tuple[str, ...] = ()
    sent: float = 0.0
    hive: str = ""
