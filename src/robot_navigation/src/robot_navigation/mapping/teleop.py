# SPDX-License-Identifier: BSD-3-Clause
"""Drives a robot by keys, laid out as in ROS's `teleop_twist_keyboard`, which Debian has not."""

from __future__ import annotations

import math
from dataclasses import dataclass

DIRECTIONS = {
    "u": (1, 0, 1), "i": (1, 0, 0), "o": (1, 0, -1),
    "j": (0, 0, 1), "k": (0, 0, 0), "l": (0, 0, -1),
    "m": (-1, 0, -1), ",": (-1, 0, 0), ".": (-1, 0, 1),
    "J": (0, 1, 0), "L": (0, -1, 0),
}  # fmt: skip
"""Forward, to the left and counter-clockwise, as shares of the speeds."""

FASTER = {"q": (1.1, 1.1), "z": (0.9, 0.9), "w": (1.1, 1.0), "x": (0.9, 1.0), "e": (1.0, 1.1),
          "c": (1.0, 0.9)}  # fmt: skip
"""By what the speed and the turning speed are multiplied."""

HELD = 0.6
"""A key that is held comes again within this time [s]: most keyboards wait 0.25 to 0.5 s."""

SPEED = 0.5
"""At the start [m/s]."""

TURN = 1.0
"""At the start [rad/s]."""

HELP = """Hold a key to drive; let it go to stop.

   u    i    o      forward, in a curve or straight
   j    k    l      turn left, stop, turn right
   m    ,    .      back, in a curve or straight
   J         L      sideways, for robots that can

q/z  both speeds by 10 %     w/x  speed     e/c  turning speed     Ctrl-C  quit
"""


@dataclass(frozen=True)
class Limits:
    """What a robot can do.

    Attributes:
        speed: [m/s]
        turn: [rad/s]
        holonomic: Whether it can go sideways.
    """

    speed: float
    turn: float
    holonomic: bool


class Teleop:
    """Turns keys into speeds.

    Attributes:
        speed: How fast it drives [m/s].
        turn: How fast it turns [rad/s].
    """

    def __init__(self, limits: Limits) -> None:
        """Stand still, with speeds that the robot can reach."""
        self._limits = limits
        self.speed = min(SPEED, limits.speed)
        self.turn = min(TURN, limits.turn)
        self._direction = (0, 0, 0)
        self._pressed = -math.inf

    def press(self, key: str, now: float) -> bool:
        """Take in a key.

        Args:
            key: One character.
            now: On a clock that never jumps [s].

        Returns:
            Whether the speeds have changed.
        """
        if key in FASTER:
            speed, turn = FASTER[key]
            self.speed = min(self.speed * speed, self._limits.speed)
            self.turn = min(self.turn * turn, self._limits.turn)
            return True
        # Any other key stops, as a person who hits one in a hurry expects.
        self._direction = DIRECTIONS.get(key, (0, 0, 0))
        self._pressed = now
        return False

    def command(self, now: float) -> tuple[float, float, float]:
        """Return how to drive now: forward, to the left [m/s], counter-clockwise [rad/s].

        Args:
            now: On the clock of `press` [s].
        """
        if now - self._pressed > HELD:
            return 0.0, 0.0, 0.0
        ahead, left, turn = self._direction
        sideways = left * self.speed if self._limits.holonomic else 0.0
        return ahead * self.speed, sideways, turn * self.turn
