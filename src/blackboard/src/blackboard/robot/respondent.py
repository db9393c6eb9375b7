# SPDX-License-Identifier: BSD-3-Clause
"""What a robot answers to a call for bids: its bids, or what they are computed from."""

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
    """Answers calls for bids in one robot's name."""

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
        self._schedule = schedule
        self._charging = charging
        self._settings = settings
        model = COST_MODELS[settings.cost_model]
        self._bidder = Bidder(robot_id, body, battery, schedule, model, charging.reserve)

    def answer(
        self, broadcast: Broadcast, here: Pose, missing: str = "", *, at_work: bool
    ) -> Bids:
        """Return what a broadcast asks for.

        `missing` says what keeps the robot from working at all; `at_work` says whether the first
        task on the schedule is under way.
        """
        refusal = self._charging.refusal or missing
        if not broadcast.basis:
            return self._bidder.answer(broadcast, here, refusal, at_work=at_work)
        basis = BidBasis(
            self._body,
            self._settings.cost_model,
            self._settings.aging,
            here,
            self._battery.level,
            at_work,
            refusal,
            tuple((entry.task.id, entry.step) for entry in self._schedule),
            self._charging.places,
            self._schedule.experience.learned,
        )
        return Bids(self._id, broadcast.epoch, broadcast.auction, (), broadcast.round, basis)
