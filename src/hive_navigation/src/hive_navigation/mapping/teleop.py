# SPDX-License-Identifier: BSD-3-Clause
"""Drives a robot by keys, laid out as in ROS's `teleop_twist_keyboard`, which Debian lacks."""

from __future__ import annotations

import math

DIRECTIONS = {
    "u": (1, 0, 1), "i": (1, 0, 0), "o": (1, 0, -1),
    "j": (0, 0, 1), "k": (0, 0, 0), "l": (0, 0, -1),
    "m": (-1, 0, -1), ",": (-1, 0, 0), ".": (-1, 0, 1),
    "J": (0, 1, 0), "L": (0, -1, 0),
}  # fmt: skip
"""For each key: forward, left and counter-clockwise, as shares of the speeds."""

FASTER = {"q": (1.1, 1.1), "z": (0.9, 0.9), "w": (1.1, 1.0), "x": (0.9, 1.0), "e": (1.0, 1.1),
          "c": (1.0, 0.9)}  # fmt: skip
"""For each key: factors on the speed and on the turning speed."""

HELD = 0.6  # a held key repeats within this time [s]: most keyboards wait 0.25 to 0.5 s
SPEED = 0.5  # at the start [m/s]
TURN = 1.0  # at the start [rad/s]

HELP = """Hold a key to drive; release it to stop.

   u    i    o      forward: curve left, straight, curve right
   j    k    l      turn left, stop, turn right
   m    ,    .      backward: curve left, straight, curve right
   J         L      left, right (holonomic robots only)

q/z  all speeds +/- 10 %     w/x  speed     e/c  turning speed     Ctrl-C  quit
"""


class Teleop:
    """Turns keys into commands."""

    def __init__(self, max_speed: float, max_turn: float, *, holonomic: bool) -> None:
        """Stand still; `max_speed` [m/s] and `max_turn` [rad/s] are the robot's limits."""
        self._limits = max_speed, max_turn
        self._holonomic = holonomic
        self.speed = min(SPEED, max_speed)  # driving speed [m/s]
        self.turn = min(TURN, max_turn)  # turning speed [rad/s]
        self._direction = (0, 0, 0)
        self._pressed = -math.inf

    def press(self, key: str, now: float) -> bool:
        """Take in a key (one character) at a time [s]; return whether the speeds have changed."""
        if key in FASTER:
            speed, turn = FASTER[key]
            self.speed = min(self.speed * speed, self._limits[0])
            self.turn = min(self.turn * turn, self._limits[1])
            return True
        # Any other key stops the robot: someone may hit one in a hurry.
        self._direction = DIRECTIONS.get(key, (0, 0, 0))
        self._pressed = now
        return False

    def command(self, now: float) -> tuple[float, float, float]:
        """Return the command at a time [s]: forward, left [m/s], counter-clockwise [rad/s]."""
        if now - self._pressed > HELD:
            return 0.0, 0.0, 0.0
        ahead, left, turn = self._direction
        sideways = left * self.speed if self._holonomic else 0.0
        return ahead * self.speed, sideways, turn * self.turn
