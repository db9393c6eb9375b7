# SPDX-License-Identifier: BSD-3-Clause
"""What the simulator and the batteries tell a recorder, beside what the hive says."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TruePlace:
    """Where a robot really is, in the map frame [m] (the simulator's ground truth)."""

    robot: str
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class BatteryReading:
    """What a robot's battery says: voltage [V] and charge left [Ah]."""

    robot: str
    voltage: float
    charge: float


@dataclass(frozen=True, slots=True)
class Collisions:
    """How many collisions the simulator has counted so far."""

    total: int
