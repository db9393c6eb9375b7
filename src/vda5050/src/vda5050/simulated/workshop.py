# SPDX-License-Identifier: BSD-3-Clause
"""What a simulated AGV does besides driving: it picks, drops, waits and charges."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import attrs

from vda5050.protocol import actions as names
from vda5050.protocol.factsheet import ActionScope, RobotAction
from vda5050.protocol.state import Load, PowerSupply
from vda5050.vehicle.ports import Outcome

if TYPE_CHECKING:
    from collections.abc import Callable

    from hive_common.pose import Velocity
    from robot_description.models import RobotModel
    from vda5050.protocol.actions import Action

WAIT = "wait"
"""An action of this maker: do nothing for `duration` [s]."""

_ANYWHERE = (ActionScope.NODE, ActionScope.EDGE)
_SCOPES = {
    names.PICK: (ActionScope.NODE,),
    names.DROP: (ActionScope.NODE,),
    names.START_CHARGING: (ActionScope.NODE, ActionScope.INSTANT),
    names.STOP_CHARGING: (ActionScope.NODE, ActionScope.INSTANT),
    WAIT: (*_ANYWHERE, ActionScope.INSTANT),
}
_HANDLING_TIME = 4.0  # of a pick or drop by an AGV without an arm, such as a lift or conveyor [s]
_LONGEST = 3600.0  # of a wait [s]
_STANDS = 0.01  # an AGV that is slower charges: charging lanes are not simulated [m/s]
_GRAVITY = 9.81  # [m/s^2]
_SECONDS_PER_HOUR = 3600.0


@attrs.define
class _TimedJob:
    """An action that takes a time, and then may succeed."""

    left: float  # [s]
    finish: Callable[[], Outcome]
    outcome: Outcome | None = None
    is_paused: bool = False

    def pause(self) -> bool:
        self.is_paused = True
        return True

    def resume(self) -> None:
        self.is_paused = False

    def cancel(self) -> bool:
        self.outcome = Outcome(done=False, text="cancelled")
        return True

    def step(self, seconds: float) -> None:
        if self.outcome is None and not self.is_paused:
            self.left -= seconds
            if self.left <= 0:
                self.outcome = self.finish()


class Workshop:
    """The tools of an AGV of a model: a load handling device, a battery, a charging contact.

    Attributes:
        charge: How full the battery is, 0..1.
        failing: Action types that fail the next so many times.
    """

    def __init__(self, model: RobotModel, charge: float = 1.0) -> None:
        self._model = model
        self._jobs: list[_TimedJob] = []
        self._load: Load | None = None
        self._charging = False
        self.charge = charge
        self.failing: dict[str, int] = {}

    @property
    def offered(self) -> tuple[RobotAction, ...]:
        """The actions that it can do."""
        return tuple(RobotAction(name, scopes) for name, scopes in _SCOPES.items())

    @property
    def loads(self) -> tuple[Load, ...]:
        """What is on board."""
        return (self._load,) if self._load is not None else ()

    @property
    def payload(self) -> float:
        """What is on board [kg]."""
        return (self._load.weight or 0.0) if self._load is not None else 0.0

    @property
    def power_supply(self) -> PowerSupply:
        """How full the battery is."""
        battery = self._model.battery
        volts = battery.voltage_empty + self.charge * (
            battery.voltage_full - battery.voltage_empty
        )
        return PowerSupply(100.0 * self.charge, self._charging, battery_voltage=volts)

    def why_not(self, action: Action, scope: ActionScope) -> str:
        """Return why it can never do an action in a scope; empty if it can."""
        scopes = _SCOPES.get(action.action_type)
        if scopes is None:
            return f"not known; known: {', '.join(_SCOPES)}"
        if scope not in scopes:
            allowed = ", ".join(each.value for each in scopes)
            return f"not on {scope.value}; allowed: {allowed}"
        if action.action_type == names.PICK:
            weight, most = _number(action, "weight"), self._model.payload
            if not 0 <= weight <= most:
                return f"a load of {weight:g} kg; allowed: 0 to {most:g} kg"
        if action.action_type == WAIT and not 0 <= _number(action, "duration") <= _LONGEST:
            return f"a duration of {action.parameter('duration')!r}; allowed: 0 to {_LONGEST:g} s"
        return ""

    def start(self, action: Action) -> _TimedJob:
        """Begin an action."""
        arm = self._model.arm
        durations = {
            names.PICK: arm.pick_duration if arm is not None else _HANDLING_TIME,
            names.DROP: arm.place_duration if arm is not None else _HANDLING_TIME,
            WAIT: _number(action, "duration"),
        }
        job = _TimedJob(durations.get(action.action_type, 0.0), lambda: self._finish(action))
        self._jobs.append(job)
        job.step(0.0)
        return job

    def _finish(self, action: Action) -> Outcome:
        kind = action.action_type
        if self.failing.get(kind, 0) > 0:
            self.failing[kind] -= 1
            return Outcome(done=False, text=f"{kind} failed, as was asked for")
        if kind == names.PICK:
            return self._pick(action)
        if kind == names.DROP:
            return self._drop(action)
        if kind in {names.START_CHARGING, names.STOP_CHARGING}:
            self._charging = kind == names.START_CHARGING
        return Outcome(done=True)

    def _pick(self, action: Action) -> Outcome:
        if self._load is not None:
            return Outcome(done=False, text=f"load {self._load.load_id} is on board already")
        self._load = Load(
            load_id=_text(action, "loadId"),
            load_type=_text(action, "loadType"),
            weight=_number(action, "weight"),
        )
        return Outcome(done=True, text=f"picked {self._load.load_id or 'a load'}")

    def _drop(self, action: Action) -> Outcome:
        wanted = _text(action, "loadId")
        if self._load is None:
            return Outcome(done=False, text="there is no load on board")
        if wanted is not None and wanted != self._load.load_id:
            return Outcome(done=False, text=f"load {self._load.load_id} is on board, not {wanted}")
        self._load = None
        return Outcome(done=True, text="dropped")

    def step(self, seconds: float, velocity: Velocity) -> None:
        """Let time pass while the AGV moves with a velocity."""
        for job in self._jobs:
            job.step(seconds)
        self._jobs = [job for job in self._jobs if job.outcome is None]
        speed = math.hypot(velocity.vx, velocity.vy)
        battery, base = self._model.battery, self._model.base
        if self._charging and speed < _STANDS:
            self.charge = min(1.0, self.charge + seconds / battery.charging_time)
            return
        self._charging = False
        force = base.friction_coefficient * (base.mass + self.payload) * _GRAVITY
        volts = (battery.voltage_full + battery.voltage_empty) / 2
        amps = (battery.idle_power + force * speed) / volts
        used = amps * seconds / _SECONDS_PER_HOUR
        self.charge = max(0.0, self.charge - used / battery.capacity)


def _number(action: Action, key: str) -> float:
    """Return a parameter that is a number; 0 where it is missing, nan where it is none."""
    value = action.parameter(key, 0.0)
    good = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if good else math.nan


def _text(action: Action, key: str) -> str | None:
    value = action.parameter(key)
    return None if value is None else str(value)
