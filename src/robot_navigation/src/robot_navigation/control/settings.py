# SPDX-License-Identifier: BSD-3-Clause
"""How a robot behaves towards what is in its way."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """What may be chosen for each robot; config/move_base.yaml explains it to users.

    Attributes:
        patience: How long it stands before something until it plans around it [s].
        attempts: How many plans around unknown things it tries for one goal.
        give_up: How long it pursues a goal that comes no nearer [s].
        announce: How much of its way it tells the others [m].
        silence: After this time without a word a robot counts as unknown [s].
        settle: How long it waits with a new way until the others have heard of it [s].
        position_tolerance: How near the goal it must stand in the end [m].
        yaw_tolerance: How near the goal's yaw it must be turned [rad].
    """

    patience: float = 5.0
    attempts: int = 5
    give_up: float = 120.0
    announce: float = 8.0
    silence: float = 2.0
    settle: float = 0.3
    position_tolerance: float = 0.1
    yaw_tolerance: float = 0.1
