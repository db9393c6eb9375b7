# SPDX-License-Identifier: BSD-3-Clause
"""Faults of a simulated AGV, at will, for tests of what a master does about them.

A line names a fault; `_EXAMPLES` shows one of each.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import attrs

from vda5050.errors import FaultError
from vda5050.protocol.state import EmergencyStop, Error, ErrorLevel, OperatingMode, State

if TYPE_CHECKING:
    from collections.abc import Callable

    from vda5050.protocol.codec import Body
    from vda5050.protocol.topics import Topic
    from vda5050.simulated.base_drive import BaseDrive
    from vda5050.simulated.workshop import Workshop
    from vda5050.vehicle.report import Report
    from vda5050.vehicle.vehicle import Vehicle

_EXAMPLES = {
    "mode": "`mode MANUAL`: changes the operating mode",
    "error": "`error batteryHot FATAL`: tells of an error of a level",
    "clear": "`clear batteryHot`: tells of it no more",
    "fail": "`fail pick 2`: lets the next two actions of a type fail",
    "stuck": "`stuck on`: does not get to the next node, and says so; or off",
    "stop": "`stop MANUAL`: an emergency stop; or REMOTE, AUTOACK, NONE",
    "battery": "`battery 0.12`: sets the charge, 0..1",
    "delay": "`delay 0.5`: sends every message so late [s]",
    "mute": "`mute on`: sends nothing, as behind a wall; or off",
    "deaf": "`deaf on`: hears nothing; or off",
    "lie": "`lie on`: tells of an order that nobody gave; or off",
}
_SWITCH = {"on": True, "off": False}
_LONGEST_DELAY = 60.0  # [s]
_MOST_FAILURES = 1000


class Mischief:
    """Does what lines say to one AGV, and stands between it and the broker."""

    def __init__(self, vehicle: Vehicle, drive: BaseDrive, workshop: Workshop) -> None:
        self._vehicle, self._drive, self._workshop = vehicle, drive, workshop
        self.report: Report | None = None  # set once it exists: it publishes through this
        self._delay = 0.0
        self._is_mute = False
        self.is_deaf = False
        self._lies = False
        self._late: deque[tuple[float, Topic, Body]] = deque()
        self._kinds: dict[str, Callable[..., None]] = {
            "mode": self._mode,
            "error": self._error,
            "clear": self._clear,
            "fail": self._fail,
            "stuck": self._stuck,
            "stop": self._stop,
            "battery": self._battery,
            "delay": self._set_delay,
            "mute": self._mute,
            "deaf": self._deaf,
            "lie": self._lie,
        }

    def do(self, line: str) -> None:
        """Do what a line says.

        Raises:
            FaultError: It says nothing that can be done.
        """
        word, *words = line.split() or [""]
        kind = self._kinds.get(word)
        if kind is None:
            raise FaultError(f"fault {line!r}; allowed: {'; '.join(_EXAMPLES.values())}")
        try:
            kind(*words)
        except (KeyError, TypeError, ValueError):
            raise FaultError(f"fault {line!r}; allowed: such as {_EXAMPLES[word]}") from None

    def release(self, now: float, publish: Callable[[Topic, Body], None]) -> None:
        """Publish what was held back until now [s]."""
        while self._late and self._late[0][0] <= now:
            _, topic, body = self._late.popleft()
            publish(topic, body)

    def pass_on(
        self, now: float, topic: Topic, body: Body, publish: Callable[[Topic, Body], None]
    ) -> None:
        """Publish a message, or hold it back, or change it."""
        if self._is_mute:
            return
        if self._lies and isinstance(body, State):
            body = attrs.evolve(body, order_id="nobodys-order", order_update_id=7)
        if self._delay or self._late:
            self._late.append((now + self._delay, topic, body))
        else:
            publish(topic, body)

    def _mode(self, name: str) -> None:
        self._vehicle.set_mode(OperatingMode[name])

    def _error(self, kind: str, level: str) -> None:
        error = Error(kind, ErrorLevel[level], error_description="as was asked for")
        self._vehicle.own_errors[kind] = error

    def _clear(self, kind: str) -> None:
        self._vehicle.own_errors.pop(kind, None)

    def _fail(self, action_type: str, times: str) -> None:
        self._workshop.failing[action_type] = int(_number(times, _MOST_FAILURES))

    def _stuck(self, text: str) -> None:
        self._drive.failure = "the way is blocked" if _SWITCH[text] else ""

    def _stop(self, name: str) -> None:
        stop = EmergencyStop[name]
        if self.report is not None:
            self.report.emergency_stop = stop
        self._drive.is_locked = stop is not EmergencyStop.NONE

    def _battery(self, text: str) -> None:
        self._workshop.charge = _number(text, 1.0)

    def _set_delay(self, text: str) -> None:
        self._delay = _number(text, _LONGEST_DELAY)

    def _mute(self, text: str) -> None:
        self._is_mute = _SWITCH[text]

    def _deaf(self, text: str) -> None:
        self.is_deaf = _SWITCH[text]

    def _lie(self, text: str) -> None:
        self._lies = _SWITCH[text]


def _number(text: str, most: float) -> float:
    value = float(text)
    if not 0 <= value <= most:
        raise ValueError(text)
    return value
