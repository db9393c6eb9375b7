# SPDX-License-Identifier: BSD-3-Clause
"""Whether an AGV can be counted on: what its connection, mode, errors and position say.

An AGV that is disconnected drives on to the end of its base. Until then nobody else may have its
task, so the robot goes on renewing its lease; afterwards it falls silent, and the hive decides as
it does about every lost robot. Where it is counts as unknown until it has told its state again.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from vda5050.protocol.state import ConnectionState, ErrorLevel, OperatingMode

if TYPE_CHECKING:
    from vda5050.protocol.state import State

STATE_SILENCE = 35.0
"""An AGV sends its state at least every 30 s; one that does not is lost [s]."""

SLOWEST = 0.5
"""A disconnected AGV drives on at this share of its top speed or faster."""

STOPPING = 2.0
"""Time for the last braking, and for a connection that broke before it was missed [s]."""

IN_CONTROL = (OperatingMode.AUTOMATIC, OperatingMode.SEMIAUTOMATIC)
"""The modes in which an AGV takes orders."""

_CONNECTIONS = {
    ConnectionState.OFFLINE: "the AGV has signed off",
    ConnectionState.CONNECTION_BROKEN: "the AGV has lost its connection to the broker",
    ConnectionState.HIBERNATING: "the AGV hibernates; wake it up",
}


class Presence:
    """Whether one AGV is there.

    Args:
        max_speed: Its top speed [m/s].
    """

    def __init__(self, max_speed: float) -> None:
        self._slowest = SLOWEST * max_speed
        self._connection: ConnectionState | None = None
        self._broker = False
        self._heard = -math.inf
        self._gone_at: float | None = None  # since when nobody can reach it [s]

    def note_broker(self, *, connected: bool, now: float) -> None:
        """Note whether there is a broker; whoever is at it says so anew when it is back."""
        self._broker = connected
        self._look(now)

    def note_connection(self, connection: ConnectionState, now: float) -> None:
        """Note what the AGV, or its last will, says about its connection."""
        self._connection = connection
        self._look(now)

    def note_state(self, now: float) -> None:
        """Note that the AGV was heard; its latched word about its connection may be lost."""
        self._heard = now
        if self._connection in {None, ConnectionState.CONNECTION_BROKEN, ConnectionState.OFFLINE}:
            self._connection = ConnectionState.ONLINE
        self._look(now)

    def _look(self, now: float) -> None:
        if self.is_connected(now):
            self._gone_at = None
        elif self._gone_at is None:
            self._gone_at = now
            self._heard = -math.inf  # what it told before is out of date once it is back

    def is_connected(self, now: float) -> bool:
        """Return whether the AGV hears and is heard."""
        fresh = now - self._heard <= STATE_SILENCE
        return self.hears and (fresh or self.hibernates)

    @property
    def hears(self) -> bool:
        """Whether the AGV is at the broker, so that it may be asked for its state."""
        reachable = {ConnectionState.ONLINE, ConnectionState.HIBERNATING}
        return self._broker and self._connection in reachable

    def is_lost(self, now: float, base_left: float) -> bool:
        """Return whether it is gone and has come to the end of its base by now.

        Args:
            now: The time [s].
            base_left: How much of its base was left when it was last heard [m].
        """
        self._look(now)
        if self._gone_at is None:
            return False
        return now - self._gone_at > base_left / self._slowest + STOPPING

    def word(self, now: float) -> str:
        """Say why nobody can reach it; empty if it is connected."""
        if not self._broker:
            return "there is no connection to the MQTT broker"
        if self.is_connected(now):
            return ""
        silent = "the AGV tells no state any more"
        return _CONNECTIONS.get(self._connection, silent) if self._connection else silent

    @property
    def hibernates(self) -> bool:
        """Whether it is connected, but takes no orders."""
        return self._connection is ConnectionState.HIBERNATING


def why_unfit(state: State, known_maps: frozenset[str] | None) -> str:
    """Return why an AGV that is connected takes no tasks; empty if it does.

    Args:
        state: What it told last.
        known_maps: The ids of maps whose place in the hive's map is known; None for any.
    """
    if state.operating_mode not in IN_CONTROL:
        return f"the AGV is in mode {state.operating_mode.name}: a person controls it"
    stopping = {ErrorLevel.FATAL, ErrorLevel.CRITICAL}
    worst = next((each for each in state.errors if each.error_level in stopping), None)
    if worst is not None:
        text = ": ".join(filter(None, [worst.error_type, worst.error_description]))
        hint = f" ({worst.error_hint})" if worst.error_hint else ""
        return f"the AGV reports a {worst.error_level.name} error: {text}{hint}"
    position = state.mobile_robot_position
    if position is None or not position.localized:
        return "the AGV does not know where it is; send initialpose, or drive it by hand"
    if known_maps is not None and position.map_id not in known_maps:
        allowed = ", ".join(sorted(known_maps))
        return f"the AGV is on map {position.map_id!r}; known: {allowed}"
    return ""
