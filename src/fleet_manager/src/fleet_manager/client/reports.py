# SPDX-License-Identifier: BSD-3-Clause
"""Everything that the hive, the simulator and the batteries report to a program outside."""

from __future__ import annotations

from dataclasses import dataclass

from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.costing.bid_basis import Bids
from blackboard.domain.characteristics import RobotStatus
from blackboard.domain.record import TaskUpdate
from blackboard.domain.task import Task
from fleet_manager.client.traffic import TrafficState

HiveReport = Task | TaskList | TaskUpdate | Bids | RobotStatus | Heartbeat | TrafficState
"""What is said on the hive's topics; a Task has been posted by somebody."""


@dataclass(frozen=True, slots=True)
class TruePlace:
    """The ground truth of a robot's position [m, map frame], from the simulator."""

    robot: str
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class BatteryReading:
    """Voltage [V] and remaining charge [Ah] of a robot's battery."""

    robot: str
    voltage: float
    charge: float


@dataclass(frozen=True, slots=True)
class Collisions:
    """The number of collisions that the simulator has counted."""

    total: int


Report = HiveReport | TruePlace | BatteryReading | Collisions


@dataclass(frozen=True, slots=True)
class HiveMessage:
    """A report, with the time at which it was sent."""

    report: Report
    stamp: float  # [s, hive's time]; 0 where unknown
