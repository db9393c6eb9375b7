# SPDX-License-Identifier: BSD-3-Clause
"""What a robot bids on a task, and what the bid was computed from."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from operator import attrgetter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

MAX_COST = 1000.0
"""The robot cannot or should not do the task."""


@dataclass(frozen=True, slots=True)
class CostTerms:
    """What a cost model may weigh."""

    energy_charge: float  # charge that the task takes out of the battery [Ah]
    charge_left: float  # charge that is left when its turn comes [Ah], above 0
    place: int  # its place in the robot's list; 1 is next
    way: float  # how much further the robot drives because of it [m]
    eta: float  # time from now until it would be done [s]
    finish: float = 0.0  # time from now until the robot would have done its whole list [s]
    # How much longer all tasks of the list wait until they are done, its own wait included, summed
    # [s].
    waiting: float = 0.0
    added_charge: float = 0.0  # how much more charge the whole list takes because of it [Ah]


class Exclusion(str, Enum):
    """Why a robot does not take a task."""

    NONE = ""  # it takes it, or it does not say
    TYPE = "type"  # it does not do such tasks
    PAYLOAD = "payload"  # it is too heavy for its body or its arm
    WAY = "way"  # there is no way for a robot of its radius
    CHARGE = "charge"  # too little charge would be left
    SERVICE = "service"  # it is out of service
    COST = "cost"  # its cost model says that it should not, or it has begun with it already


@dataclass(frozen=True, slots=True)
class Bid:
    """What one task would cost one robot (message TaskCost)."""

    robot_id: str
    task_id: str  # on what
    cost: float  # 0 to `MAX_COST`
    energy_cost: float = 0.0  # predicted charge for the task [Ah]
    eta: float = 0.0  # predicted time from now until it would be done [s]
    reason: str = ""  # why the cost is `MAX_COST`; empty otherwise
    # Id of the task that the robot is doing now; empty when it could begin at once.
    under_way: str = ""
    # Cost of doing the task at once and what is under way later, 0 to `MAX_COST`, which says that
    # what is under way cannot be put off for it.
    interrupt_cost: float = MAX_COST
    # The most that the robot can carry of such a task [kg]; -1 where it can carry nothing of it, 0
    # where it does not say.
    most_payload: float = 0.0
    # What the cost was worked out from; None where the robot takes no part.
    terms: CostTerms | None = None
    exclusion: str = ""  # why the cost is `MAX_COST`, one of `Exclusion`
    # Of how many drives the predictions were learned; 0 where they are the formula's.
    learned_from: int = 0
    duration: float = 0.0  # predicted time of the task itself [s]; 0 if not stated
    formula_duration: float = 0.0  # the same by the formula [s]; 0 if not stated
    formula_energy_cost: float = 0.0  # `energy_cost` by the formula [Ah]; 0 if not stated

    @property
    def is_able(self) -> bool:
        """Whether the robot would take the task."""
        return self.cost < MAX_COST

    @property
    def rank(self) -> tuple[float, float, str]:
        """The order of bids on a task: by cost, then by who has it done first, then by name."""
        return self.cost, self.eta, self.robot_id


def ranked(bids: Iterable[Bid]) -> list[Bid]:
    """Return bids on a task, the one that goes first at the front; see `Bid.rank`."""
    return sorted(bids, key=attrgetter("rank"))
