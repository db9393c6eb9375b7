# SPDX-License-Identifier: BSD-3-Clause
"""The colours of robots, the same in RViz, in the windows and in pictures."""

from __future__ import annotations

import zlib

Color = tuple[float, float, float, float]  # red, green, blue and opacity, 0 to 1

COLORS: tuple[Color, ...] = (
    (0.90, 0.62, 0.00, 1.0),
    (0.34, 0.71, 0.91, 1.0),
    (0.00, 0.62, 0.45, 1.0),
    (0.94, 0.89, 0.26, 1.0),
    (0.00, 0.45, 0.70, 1.0),
    (0.84, 0.37, 0.00, 1.0),
    (0.80, 0.47, 0.65, 1.0),
)
"""For robots, from Okabe and Ito (Color Universal Design, 2008)."""

NO_ROBOT: Color = (0.45, 0.45, 0.45, 1.0)


def robot_color(robot: str) -> Color:
    """Return the colour of a robot, which depends on its name alone; grey without a robot."""
    if not robot:
        return NO_ROBOT
    digits = "".join(filter(str.isdecimal, robot))
    number = int(digits) - 1 if digits else zlib.crc32(robot.encode())
    return COLORS[number % len(COLORS)]
