# SPDX-License-Identifier: BSD-3-Clause
"""What a robot answers when the blackboard asks: its bids, or what they are worked out from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.costing.bid_basis import BidBasis, Bids
from blackboard.costing.bidding import Bidder
from blackboard.costing.cost import COST_MODELS

if TYPE_CHECKING:
    from blackboard.costing.schedule import Schedule
    from blackboard.domain.battery import Battery
    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.record import Broadcast
    from blackboard.domain.settings import RobotSettings
    from blackboard.robot.charging import Charging
    from hive_common.pose import Pose


class Respondent:
    """Answers for one robot.

    Args:
        robot_id: Its name.
        body: What it is.
        battery: Its battery.
        itinerary: What it has to do already.
        charging: Says whether it takes tasks, and what it has to keep to reach a charger.
        settings: By which cost model it bids.
    """

    def __init__(
        self,
        robot_id: str,
        body: RobotCharacteristics,
        battery: Battery,
        schedule: Schedule,
        charging: Charging,
        settings: RobotSettings,
    ) -> None:
        self._id = robot_id
        self._body = body
        self._battery = battery
        self._list = schedule
        self._charging = charging
        self._settings = settings
        model = COST_MODELS[settings.cost_model]
        self._bidder = Bidder(robot_id, body, battery, schedule, model, charging.reserve)

    def answer(self, broadcast: Broadcast, here: Pose, *, at_work: bool) -> Bids:
        """Return what is asked for.

        Args:
            broadcast: The question.
            here: Where the robot stands.
            at_work: Whether the first task on its list is being done.
        """
        if not broadcast.basis:
            return self._bidder.answer(broadcast, here, self._charging.refusal, at_work=at_work)
        asked = (broadcast.epoch, broadcast.auction)
        basis = self._basis(here, at_work=at_work)
        return Bids(self._id, *asked, (), broadcast.round, basis)

    def _basis(self, here: Pose, *, at_work: bool) -> BidBasis:
        return BidBasis(
            self._body,
            self._settings.cost_model,
            self._settings.aging,
            here,
            self._battery.level,
            at_work,
            self._charging.refusal,
            tuple((entry.task.id, entry.step) for entry in self._list),
            self._charging.places,
            self._list.pace.times,
        )
