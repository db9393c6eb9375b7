# SPDX-License-Identifier: BSD-3-Clause
"""What a `move_base` robot can do for a master besides driving: pick and put down with its arm."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import attrs

from vda5050.protocol import actions as names
from vda5050.protocol.factsheet import ActionScope, RobotAction
from vda5050.protocol.state import Load, PowerSupply
from vda5050.vehicle.ports import Outcome

if TYPE_CHECKING:
    from collections.abc import Callable

    from robot_description.models import RobotModel
    from vda5050.protocol.actions import Action

_FULL = 100.0
"""What a robot tells that has no battery to ask [%]: the standard wants a number."""


class ArmControl(Protocol):
    """The action `pick` of a robot: one order at a time."""

    def start(
        self, *, picks: bool, task_id: str, payload: float, done: Callable[[Outcome], None]
    ) -> None:
        """Pick a load, or put down what was picked for a task; [kg]."""

    def cancel(self) -> None:
        """Drop the order."""


@attrs.define
class _ArmJob:
    """An order to the arm."""

    arm: ArmControl
    outcome: Outcome | None = None

    def pause(self) -> bool:
        return False

    def resume(self) -> None:
        """Nothing to do: an arm does not pause."""

    def cancel(self) -> bool:
        if self.outcome is None:
            self.arm.cancel()
            self.outcome = Outcome(done=False, text="cancelled")
        return True


class ArmTools:
    """The tools of a robot of a model.

    Attributes:
        charge: How full the battery is [%].
        is_charging: Whether it is being charged.
    """

    def __init__(self, model: RobotModel, arm: ArmControl | None) -> None:
        self._model, self._arm = model, arm
        self._load: Load | None = None
        self._picked_for = ""
        self.charge = _FULL
        self.is_charging = False

    @property
    def offered(self) -> tuple[RobotAction, ...]:
        """The actions that it can do."""
        kinds = (names.PICK, names.DROP) if self._arm is not None else ()
        return tuple(RobotAction(kind, (ActionScope.NODE,)) for kind in kinds)

    @property
    def loads(self) -> tuple[Load, ...]:
        """What is on board."""
        return (self._load,) if self._load is not None else ()

    @property
    def power_supply(self) -> PowerSupply:
        """How full its battery is."""
        return PowerSupply(self.charge, self.is_charging)

    def why_not(self, action: Action, scope: ActionScope) -> str:
        """Return why it can never do an action in a scope; empty if it can."""
        offered = {each.action_type: each.action_scopes for each in self.offered}
        if action.action_type not in offered:
            return f"not known; known: {', '.join(offered) or 'none'}"
        if scope not in offered[action.action_type]:
            return f"not on {scope.value}; allowed: NODE"
        weight = action.parameter("weight", 0.0)
        most = self._model.arm.payload if self._model.arm is not None else 0.0
        if isinstance(weight, bool) or not isinstance(weight, int | float):
            return f"a weight of {weight!r}; allowed: a number of kg"
        return "" if 0 <= weight <= most else f"{weight:g} kg; allowed: 0 to {most:g} kg"

    def start(self, action: Action) -> _ArmJob:
        """Begin an action that `why_not` has nothing against."""
        if self._arm is None:
            raise ValueError("no arm; such actions are refused")
        job = _ArmJob(self._arm)
        picks = action.action_type == names.PICK
        load = Load(
            load_id=_text(action, "loadId"),
            load_type=_text(action, "loadType"),
            weight=float(action.parameter("weight", 0.0)),
        )
        task = action.action_id if picks else self._picked_for

        def end(outcome: Outcome) -> None:
            if job.outcome is None:
                job.outcome = outcome
            if outcome.done:
                self._load, self._picked_for = (load, task) if picks else (None, "")

        self._arm.start(picks=picks, task_id=task, payload=load.weight or 0.0, done=end)
        return job


def _text(action: Action, key: str) -> str | None:
    value = action.parameter(key)
    return None if value is None else str(value)
