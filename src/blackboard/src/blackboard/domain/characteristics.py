# SPDX-License-Identifier: BSD-3-Clause
"""What a robot is, and its status, as values (the report's table of characteristics)."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Annotated, Any

import attrs

from blackboard.domain.battery import BatteryModel
from blackboard.domain.task import StepKind, Task, TaskType
from blackboard.errors import CharacteristicsError
from hive_common.map_id import NO_MAP, MapId
from hive_common.pose import Pose
from hive_common.structuring import (
    Allowed,
    NotAllowedError,
    between,
    one_of,
    positive,
    structure,
)


class RobotState(IntEnum):
    """Whether a robot takes tasks."""

    IDLE = 0  # in service, with nothing to do
    BUSY = 1  # in service, at work
    DEFECT = 2  # out of service until an operator puts it back
    CHARGING = 3  # out of service until its battery is full
    OFFLINE = 4  # not heard from; a robot never reports this itself

    @property
    def in_service(self) -> bool:
        """Whether it takes tasks."""
        return self in {RobotState.IDLE, RobotState.BUSY}


@dataclass(frozen=True, slots=True)
class RobotCharacteristics:
    """What a robot is, as far as bids need it (the report's table of characteristics).

    Raises:
        CharacteristicsError: A value is outside its range.
    """

    mass: float  # of the robot alone [kg], above 0
    payload: float  # what it can carry [kg], at least 0
    max_speed: float  # [m/s], above 0
    friction_coefficient: float  # rolling friction of its wheels on the floor, above 0
    radius: float  # of the circle around its base that has to fit through doors [m], above 0
    battery: BatteryModel  # what kind of battery it has
    # The types of tasks it can do.
    capabilities: frozenset[TaskType] = field(default_factory=lambda: frozenset(TaskType))
    arm_payload: float = 0.0  # what its arm can lift [kg]; 0 without an arm
    arm_power: float = 0.0  # drawn while the arm works [W], at least 0
    pick_duration: float = 0.0  # [s], at least 0
    place_duration: float = 0.0  # [s], at least 0
    idle_power: float = 0.0  # drawn all the time [W], at least 0

    def __post_init__(self) -> None:
        above_0 = {"mass", "max_speed", "friction_coefficient", "radius"}
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if isinstance(value, BatteryModel | frozenset):
                continue
            if not (math.isfinite(value) and (value > 0 if name in above_0 else value >= 0)):
                allowed = "above 0" if name in above_0 else "at least 0"
                raise CharacteristicsError(f"{name} is {value!r}; allowed: {allowed}")

    def arm_time(self, kind: StepKind) -> float:
        """Return how long the arm works in a kind of step [s]; 0 in a drive."""
        times = {StepKind.PICK: self.pick_duration, StepKind.PLACE: self.place_duration}
        return times.get(kind, 0.0)

    def most_payload(self, kind: TaskType) -> float:
        """Return the maximum payload for a type of task [kg]; -1 if it can carry nothing."""
        most = self.carries[kind]
        return most if most > 0 else -1.0

    @property
    def carries(self) -> tuple[float, ...]:
        """For each type of task, the maximum payload [kg]; -1 if it does no such task."""
        return tuple(
            (min(self.payload, self.arm_payload) if kind.picks else self.payload)
            if kind in self.capabilities
            else -1.0
            for kind in TaskType
        )

    def excludes(self, task: Task) -> str:
        """Return why the robot can never do a task; empty if it can."""
        kind = TaskType(task.type)
        if kind not in self.capabilities:
            return f"does not do {kind.name}"
        if task.payload > self.payload:
            return f"carries at most {self.payload:g} kg, not {task.payload:g} kg"
        if kind.picks and task.payload > self.arm_payload:
            return f"its arm lifts at most {self.arm_payload:g} kg, not {task.payload:g} kg"
        return ""


class _Part:
    """A part of a robot model, of which bidding needs only some keys."""

    OTHER_KEYS = True


_MOST = 1e6
"""In kg, m/s, Ah, V, W or s: more than any robot has, and little enough to reckon with."""

_Above0 = Annotated[float, positive("a number", _MOST)]
_AtLeast0 = Annotated[float, between(0, _MOST, "a number")]


def _is_outline(corners: tuple[tuple[float, float], ...]) -> bool:
    """Return whether corners go counter-clockwise around the base's middle."""
    too_far = any(abs(number) > _MOST for corner in corners for number in corner)
    edges = zip(corners, corners[1:] + corners[:1], strict=True)
    return not too_far and min((x * b - y * a for (x, y), (a, b) in edges), default=0.0) > 0


@attrs.frozen
class _Base(_Part):
    mass: _Above0
    max_speed: _Above0
    friction_coefficient: _Above0
    footprint: Annotated[
        tuple[tuple[float, float], ...],
        Allowed(
            "corners [x, y] [m], counter-clockwise around the middle of the base", _is_outline
        ),
    ]


@attrs.frozen
class _Battery(_Part):
    capacity: _Above0
    voltage_full: _Above0
    voltage_empty: _Above0
    charging_time: _Above0
    idle_power: _AtLeast0


@attrs.frozen
class _Arm(_Part):
    payload: _AtLeast0 = 0.0
    power: _AtLeast0 = 0.0
    pick_duration: _AtLeast0 = 0.0
    place_duration: _AtLeast0 = 0.0


@attrs.frozen
class _Model(_Part):
    base: _Base
    payload: _AtLeast0
    battery: _Battery
    capabilities: tuple[Annotated[str, one_of(*(kind.name for kind in TaskType))], ...]
    arm: _Arm = _Arm()


def characteristics_from(content: Mapping[str, Any]) -> RobotCharacteristics:
    """Read a robot model, as `robot_description/models/*.yaml` and the parameter hold it.

    Raises:
        CharacteristicsError: Something is missing or not allowed; the text names it.
    """
    try:
        model = structure(content, _Model)
    except NotAllowedError as error:
        raise CharacteristicsError(
            f"the robot's characteristics: {error}; "
            "see docs/adding-a-robot.md for what a model file holds"
        ) from None
    base, battery, arm = model.base, model.battery, model.arm
    return RobotCharacteristics(
        mass=base.mass,
        payload=model.payload,
        max_speed=base.max_speed,
        friction_coefficient=base.friction_coefficient,
        radius=_inscribed_radius(base.footprint),
        battery=BatteryModel(
            battery.capacity, battery.voltage_full, battery.voltage_empty, battery.charging_time
        ),
        capabilities=frozenset(TaskType[name] for name in model.capabilities),
        arm_payload=arm.payload,
        arm_power=arm.power,
        pick_duration=arm.pick_duration,
        place_duration=arm.place_duration,
        idle_power=battery.idle_power,
    )


def _inscribed_radius(footprint: tuple[tuple[float, float], ...]) -> float:
    """Return the distance from the base to the nearest edge of its convex footprint [m]."""
    distances = []
    for (x, y), (next_x, next_y) in zip(footprint, footprint[1:] + footprint[:1], strict=True):
        across, along = next_y - y, x - next_x
        length = math.sqrt(across * across + along * along)
        distances.append(across / length * x + along / length * y)
    return min(distances)


@dataclass(frozen=True, slots=True)
class RobotStatus:
    """The status of a robot (message RobotStatus)."""

    robot_id: str
    state: RobotState  # whether it can be counted on
    pose: Pose  # of its base in the map frame
    charge: float  # from 0 to 1
    payload: float = 0.0  # on board now [kg]
    task_id: str = ""  # the task under way; empty for none
    reason: str = ""  # why it is out of service or stands still, or what is wrong; empty otherwise
    tasks: tuple[str, ...] = ()  # its schedule: all its tasks, in the order it will do them
    sent: float = 0.0  # when it was sent, by the robot's own clock [s]
    hive: str = ""  # id of its hive; empty before it belongs to one
    # For each type of task, the most it can carry [kg]; -1 if it does no such task. Empty if it
    # does not say.
    carries: tuple[float, ...] = ()
    map: MapId = NO_MAP  # that it uses; without a checksum it uses none, or does not say
    charger: str = ""  # that it asks for, drives to or stands at; empty for none
    at_charger: bool = False  # whether it stands at `charger`
    # Since when it says these two, by its date [s]; what it says later has a later one.
    charger_since: float = 0.0

    def most_payload(self, kind: TaskType) -> float | None:
        """Return the maximum payload for a type of task [kg]; None if it does not say.

        -1 if it does no such task.
        """
        return self.carries[kind] if kind < len(self.carries) else None
