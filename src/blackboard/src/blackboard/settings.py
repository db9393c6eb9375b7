# SPDX-License-Identifier: BSD-3-Clause
"""Every number and name that a user may set; `config/*.yaml` is the manual to them."""

from __future__ import annotations

from dataclasses import dataclass, fields

from blackboard.cost import COST_MODELS
from blackboard.errors import SettingsError

DISTANCES = ("path", "euclidean")
"""How the length of a way is measured: on the map, or as the crow flies."""


@dataclass(frozen=True)
class Settings:
    """Checks what all settings have in common: numbers are above 0, names are known ones.

    Raises:
        SettingsError: A value is not allowed; the text names it and what is.
    """

    def __post_init__(self) -> None:
        names = {"cost_model": tuple(COST_MODELS), "distance": DISTANCES}
        for each in fields(self):
            value = getattr(self, each.name)
            if each.name in names:
                if value not in names[each.name]:
                    allowed = ", ".join(names[each.name])
                    raise SettingsError(f"{each.name} is {value!r}; allowed: {allowed}")
            elif not 0 < value < float("inf"):
                raise SettingsError(f"{each.name} is {value!r}; allowed: above 0")


@dataclass(frozen=True)
class BackupSettings(Settings):
    """How often the active blackboard speaks.

    Attributes:
        heartbeat: Time between two heartbeats [s].
        sync_period: Least time between two copies of the task list [s]; changes within it are
            sent together.
    """

    heartbeat: float = 0.2
    sync_period: float = 0.2


@dataclass(frozen=True)
class BlackboardSettings(Settings):
    """How patient the blackboard is.

    Attributes:
        bid_timeout: Longest time that an auction stays open [s].
        robot_timeout: A robot that is silent for longer counts as offline [s].
        order_timeout: An order that a robot's status does not show by then is given again [s].
        retry_period: What nobody could take is auctioned again after this time, even if nothing
            seems to have changed [s].
        most_hand_backs: A task that robots have handed back this often is given up.
    """

    bid_timeout: float = 2.0
    robot_timeout: float = 5.0
    order_timeout: float = 2.0
    retry_period: float = 30.0
    most_hand_backs: int = 5


@dataclass(frozen=True)
class RobotSettings(Settings):
    """How a robot bids and speaks.

    Attributes:
        cost_model: A name of `COST_MODELS`.
        status_period: Time between two statuses, and before a report is repeated [s].
    """

    cost_model: str = "report"
    status_period: float = 1.0


@dataclass(frozen=True)
class ControllerSettings(Settings):
    """How patient a controller is.

    Attributes:
        attempts: How often a step is tried before the task is given up.
        retry_delay: Pause before it is tried again [s].
        server_timeout: An action server that is silent for longer counts as lost [s].
    """

    attempts: int = 3
    retry_delay: float = 3.0
    server_timeout: float = 5.0


@dataclass(frozen=True)
class WaysSettings(Settings):
    """How the length of a way is measured.

    Attributes:
        distance: A name of `DISTANCES`.
    """

    distance: str = "path"
