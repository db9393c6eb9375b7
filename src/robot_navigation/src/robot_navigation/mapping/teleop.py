# SPDX-License-Identifier: BSD-3-Clause
"""Drives a robot by keys, laid out as in ROS's `teleop_twist_keyboard`, which Debian lacks."""

from __future__ import annotations

import math
from dataclasses import dataclass

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

HELD = 0.6
"""A held key repeats within this time [s]: most keyboards wait 0.25 to 0.5 s."""

SPEED = 0.5
"""At the start [m/s]."""

TURN = 1.0
"""At the start [rad/s]."""

HELP = """Hold a key to drive; release it to stop.

   u    i    o      forward: curve left, straight, curve right
   j    k    l      turn left, stop, turn right
   m    ,    .      backward: curve left, straight, curve right
   J         L      left, right (holonomic robots only)

q/z  all speeds +/- 10 %     w/x  speed     e/c  turning speed     Ctrl-C  quit
"""


@dataclass(frozen=True)
class Limits:
    """What a robot can do.

    Attributes:
        speed: [m/s]
        turn: [rad/s]
        holonomic: Whether it can move sideways.
    """

    speed: float
    turn: float
    holonomic: bool


class Teleop:
    """Turns keys into commands.

    Attributes:
        speed: Driving speed [m/s].
        turn: Turning speed [rad/s].
    """

    def __init__(self, limits: Limits) -> None:
        """Stand still, with speeds that the robot can reach."""
        self._limits = limits
        self.speed = min(SPEED, limits.speed)
        self.turn = min(TURN, limits.turn)
        self._direction = (0, 0, 0)
        self._pressed = -math.inf

    def press(self, key: str, now: float) -> bool:
        """Take in a key (one character) at a time [s]; return whether the speeds have changed."""
        if key in FASTER:
            speed, turn = FASTER[key]
            self.speed = min(self.speed * speed, self._limits.speed)
            self.turn = min(self.turn * turn, self._limits.turn)
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
        sideways = left * self.speed if self._limits.holonomic else 0.0
        return ahead * self.speed, sideways, turn * self.turn
