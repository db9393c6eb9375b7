# SPDX-License-Identifier: BSD-3-Clause
"""What a vehicle does for instant actions.

Source: VDA 5050 3.0, table 4 "Predefined actions"; earlier versions have fewer of them, and call
`initializePosition` `initPosition`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hive_common.pose import Pose
from vda5050.protocol import actions as names
from vda5050.protocol.factsheet import ActionScope
from vda5050.protocol.state import OperatingMode
from vda5050.vehicle.ports import Outcome
from vda5050.vehicle.refusals import Cause, Refusal, about_instant_action

if TYPE_CHECKING:
    from collections.abc import Callable

    from vda5050.protocol.actions import Action, InstantActions
    from vda5050.vehicle.vehicle import Vehicle

OFFERED = (
    names.CANCEL_ORDER,
    names.START_PAUSE,
    names.STOP_PAUSE,
    names.STATE_REQUEST,
    names.FACTSHEET_REQUEST,
    names.INIT_POSITION,
)
"""The instant actions that every vehicle does, in every version."""

_SINCE_3 = {
    "initializePosition": names.INIT_POSITION,
}
"""What version 3.0 calls actions of the versions before."""

_DONE = Outcome(done=True)


class RemoteControl:
    """Does the instant actions that a vehicle gets.

    Args:
        vehicle: The vehicle.
        tell_state: Publishes the state at once.
        tell_factsheet: Publishes the factsheet.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        tell_state: Callable[[], None],
        tell_factsheet: Callable[[], None],
    ) -> None:
        self._vehicle = vehicle
        self._tell_state, self._tell_factsheet = tell_state, tell_factsheet
        self._own: dict[str, Callable[[Action], Callable[[], Outcome | None] | str]] = {
            names.CANCEL_ORDER: self._cancel,
            names.START_PAUSE: self._pause,
            names.STOP_PAUSE: self._go_on,
            names.STATE_REQUEST: self._request_state,
            names.FACTSHEET_REQUEST: self._request_factsheet,
            names.INIT_POSITION: self._init_position,
            "clearInstantActions": self._clear,
            "retry": lambda action: self._retry(action, skip=False),
            "skipRetry": lambda action: self._retry(action, skip=True),
            "startHibernation": self._hibernate,
            "stopHibernation": self._wake,
        }

    def act(self, message: InstantActions) -> None:
        """Do instant actions, each once, however often it comes."""
        for action in message.actions:
            if not self._vehicle.instant_actions.knows(action.action_id):
                self._begin(action)

    def _begin(self, action: Action) -> None:
        vehicle = self._vehicle
        if vehicle.is_hibernating and action.action_type != "stopHibernation":
            return
        own = self._own.get(_SINCE_3.get(action.action_type, action.action_type))
        why = "" if own else vehicle.tools.why_not(action, ActionScope.INSTANT)
        if not why and not self._is_allowed(action):
            why = f"not in operating mode {vehicle.mode.value}"
        if why:
            self._refuse(action, Refusal(Cause.INSTANT_ACTION, f"{action.action_type}: {why}"))
            return
        if own is None:
            vehicle.instant_actions.add_job(action, vehicle.tools.start(action))
        else:
            poll = own(action)
            if isinstance(poll, str):
                cause = Cause.INSTANT_ACTION
                if action.action_type == names.CANCEL_ORDER:
                    cause = Cause.NO_ORDER_TO_CANCEL
                self._refuse(action, Refusal(cause, poll))
                return
            vehicle.instant_actions.add(action, poll)
        vehicle.instant_errors = ()

    def _is_allowed(self, action: Action) -> bool:
        """Return whether the operating mode allows an action; who only asks is always answered."""
        mode = self._vehicle.mode
        asks = action.action_type in {names.STATE_REQUEST, names.FACTSHEET_REQUEST}
        if mode is OperatingMode.INTERVENED:
            return asks or action.action_type == names.CANCEL_ORDER
        return asks or mode in {OperatingMode.AUTOMATIC, OperatingMode.SEMIAUTOMATIC}

    def _refuse(self, action: Action, refusal: Refusal) -> None:
        vehicle = self._vehicle
        vehicle.instant_actions.add(action, lambda: Outcome(done=False, text=refusal.text))
        error = refusal.error(vehicle.identity.version, about_instant_action(action))
        vehicle.instant_errors = (*vehicle.instant_errors, error)[-_MOST_ERRORS:]

    def _cancel(self, action: Action) -> Callable[[], Outcome | None] | str:
        vehicle = self._vehicle
        wanted = action.parameter("orderId")
        if vehicle.is_idle or vehicle.book.is_cancelled:
            return "there is no order to cancel"
        if wanted is not None and wanted != vehicle.book.order_id:
            return f"the order is {vehicle.book.order_id}, not {wanted}"
        vehicle.cancel()
        return lambda: None if vehicle.is_cancelling else _DONE

    def _pause(self, _: Action) -> Callable[[], Outcome | None] | str:
        vehicle = self._vehicle
        vehicle.pause()
        return lambda: None if vehicle.drive.is_driving and vehicle.is_paused else _DONE

    def _go_on(self, _: Action) -> Callable[[], Outcome | None] | str:
        self._vehicle.go_on()
        return lambda: _DONE

    def _request_state(self, _: Action) -> Callable[[], Outcome | None] | str:
        self._tell_state()
        return lambda: _DONE

    def _request_factsheet(self, _: Action) -> Callable[[], Outcome | None] | str:
        self._tell_factsheet()
        return lambda: _DONE

    def _init_position(self, action: Action) -> Callable[[], Outcome | None] | str:
        vehicle = self._vehicle
        numbers = [action.parameter(key) for key in ("x", "y", "theta")]
        if not all(isinstance(each, int | float) for each in numbers):
            return f"x, y, theta are {numbers}; allowed: numbers [m, m, rad]"
        pose = Pose(*map(float, numbers))
        if not pose.is_finite or abs(pose.yaw) > math.tau:
            return f"{tuple(pose)} is no pose [m, m, rad]"
        if action.parameter("mapId", vehicle.identity.map_id) != vehicle.identity.map_id:
            return f"mapId {action.parameter('mapId')}; known: {vehicle.identity.map_id}"
        if not vehicle.is_idle:
            return f"order {vehicle.book.order_id} is not finished; cancel it first"
        if not vehicle.drive.set_pose(pose):
            return f"the vehicle cannot be at {pose}"
        vehicle.book.forget_place(str(action.parameter("lastNodeId", "")))
        return lambda: _DONE

    def _clear(self, _: Action) -> Callable[[], Outcome | None] | str:
        self._vehicle.instant_actions.clear_ended()
        return lambda: _DONE

    def _retry(self, action: Action, *, skip: bool) -> Callable[[], Outcome | None] | str:
        wanted = str(action.parameter("actionId", ""))
        if not self._vehicle.actions.retry(wanted, skip=skip):
            return f"action {wanted!r} is not RETRIABLE"
        return lambda: _DONE

    def _hibernate(self, _: Action) -> Callable[[], Outcome | None] | str:
        vehicle = self._vehicle
        if not vehicle.is_idle:
            vehicle.cancel()

        def poll() -> Outcome | None:
            vehicle.is_hibernating = not vehicle.is_cancelling
            return _DONE if vehicle.is_hibernating else None

        return poll

    def _wake(self, _: Action) -> Callable[[], Outcome | None] | str:
        self._vehicle.is_hibernating = False
        return lambda: _DONE


_MOST_ERRORS = 10
"""So many refused instant actions are told of."""
