# SPDX-License-Identifier: BSD-3-Clause
"""Sends a robot to a charger in time, and back to work when it has charged enough."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import TYPE_CHECKING

from blackboard.costing.effort import charge_to_reach
from blackboard.domain.characteristics import RobotState
from blackboard.domain.settings import ChargingSettings
from blackboard.domain.talker import CHARGER_CLAIM
from blackboard.domain.task import Task, TaskType
from blackboard.robot.charger_claims import NEAR, Claim, Claims
from blackboard.robot.executor import CommandState

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from blackboard.domain.battery import Battery
    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.talker import Talker
    from blackboard.robot.executor import CommandResult, Controller
    from blackboard.robot.service import Service
    from hive_common.pose import Pose

_AVOID = 30.0
"""A charger to which a robot found no way is not tried again for so long [s]."""


@dataclass(frozen=True)
class ChargingPlan:
    """Where a fleet's robots charge, and when.

    Attributes:
        chargers: Where a robot stands at each charger, by name [map frame]; none: robots charge
            only where a person sets them to.
        settings: The thresholds.
    """

    chargers: Mapping[str, Pose] = field(default_factory=dict)
    settings: ChargingSettings = field(default_factory=ChargingSettings)


class Phase(Enum):
    """What a robot is about with a charger."""

    AWAY = auto()
    """Nothing, or waiting for one."""
    GOING = auto()
    """On its way to one."""
    THERE = auto()
    """At one, charging."""
    LEAVING = auto()
    """Full, and on its way back to where it started, so that others find the charger free."""


class Charging:
    """One robot's battery between work and charger.

    Args:
        talker: How it agrees with the others.
        robot_id: Its name.
        body: What it is.
        battery: Its battery.
        ways: Knows how far the chargers are.
        controller: Drives it.
        service: Told when it leaves service to charge, and when it comes back.
        plan: Where and when it charges; only where a person sets it to, where left out.
    """

    def __init__(
        self,
        talker: Talker,
        robot_id: str,
        body: RobotCharacteristics,
        battery: Battery,
        path_lengths: PathLengths,
        controller: Controller,
        service: Service,
        plan: ChargingPlan | None = None,
    ) -> None:
        self._talker = talker
        self._id = robot_id
        self._body = body
        self._battery = battery
        self._path_lengths = path_lengths
        self._controller = controller
        self._service = service
        self._plan = plan = plan or ChargingPlan()
        self._may_go: Callable[[], bool] = lambda: False
        self._changed: Callable[[], None] = lambda: None
        self._claims = Claims(robot_id, plan.chargers, talker.now())
        self._phase = Phase.AWAY
        self._avoided: dict[str, float] = {}
        self._pose: Pose | None = None
        self._home: Pose | None = None

    def start(self, pose: Pose, may_go: Callable[[], bool], changed: Callable[[], None]) -> None:
        """Begin to listen.

        Args:
            pose: Where the robot stands, and goes when it is full [map frame].
            may_go: Says whether it may drive now.
            changed: Called when there is something new to consider.
        """
        self._pose = self._home = pose
        self._may_go, self._changed = may_go, changed
        if not self._plan.chargers:
            return
        self._talker.subscribe(CHARGER_CLAIM, self._hear)
        at = next((name for name in self._plan.chargers if self._is_at(name)), None)
        if at is not None:
            self._claims.claim(at, self._talker.now(), holds=True)
            self._phase = Phase.THERE
            if self._battery.level < self._plan.settings.enough:
                self._leave_service(f"charges at {at}")
        self._say()

    @property
    def is_charging(self) -> bool:
        """Whether it stands at a charger, or where a person set it to charge."""
        by_hand = self._service.state is RobotState.CHARGING and not self._claims.charger
        return self._phase is Phase.THERE or (by_hand and not self._service.is_on_its_own)

    @property
    def places(self) -> tuple[Pose, ...]:
        """Where the chargers are [map frame]."""
        return tuple(self._plan.chargers.values())

    @property
    def refusal(self) -> str:
        """Why it takes no new task; empty when it does."""
        if self._service.reason:
            return self._service.reason
        if self._plan.chargers and self._is_critical and self._phase is not Phase.THERE:
            return f"its battery is at {self._battery.level:.0%}: it charges next"
        return ""

    def reserve(self, end: Pose) -> float:
        """Return the charge [Ah] that it has to keep to reach a charger from a pose."""
        return charge_to_reach(self.places, end, self._body, self._path_lengths, self._battery)

    def note_pose(self, pose: Pose) -> None:
        """Note where it stands; a charger that it has left is free for others."""
        self._pose = pose
        if self._phase in {Phase.THERE, Phase.LEAVING} and not self._is_at(self._claims.charger):
            self._claims.release()
            if self._phase is Phase.THERE:
                self._phase = Phase.AWAY

    def pass_time(self, period: float) -> None:
        """Draw what it takes to be switched on for a time [s], and charge where it charges."""
        self._battery.update_level(self._body.idle_power * period)
        if self.is_charging:
            self._battery.charge(period)
            by_hand = self._phase is not Phase.THERE
            wanted = 1.0 if by_hand else self._plan.settings.enough
            if self._service.state is RobotState.CHARGING and self._battery.level >= wanted:
                self._service.be_charged()
        if self._battery.level <= 0.0 and self._service.state is not RobotState.DEFECT:
            self.abandon()
            self._service.strand(f"stranded at {self._pose}: its battery is empty")
        self._say()

    def consider(self, *, idle: bool, loaded: bool) -> None:
        """Decide what to do about the battery now.

        Args:
            idle: Whether the robot's list is empty.
            loaded: Whether the robot's arm has taken a load on board that it has to put down.
        """
        if not self._plan.chargers or self._service.state is RobotState.DEFECT:
            return
        if self._phase in {Phase.GOING, Phase.LEAVING} and not self._may_go():
            self._halt()
        elif self._phase is Phase.GOING and not idle:
            self._halt()  # what has just come may have stopped the drive
        elif self._phase is Phase.LEAVING and not idle:
            self._phase = Phase.THERE if self._is_at(self._claims.charger) else Phase.AWAY
        elif self._phase is Phase.AWAY and self._wants(idle=idle, loaded=loaded):
            self._seek(idle=idle)
        elif self._phase is Phase.AWAY:
            self._claims.release()
        elif self._phase is Phase.THERE and idle and self._battery.level >= self._full:
            self._lease_keeper()

    def abandon(self) -> None:
        """Drop what is under way, because a person has decided otherwise."""
        if self._phase in {Phase.GOING, Phase.LEAVING}:
            self._halt()

    @property
    def _is_critical(self) -> bool:
        return self._battery.level < self._plan.settings.critical

    @property
    def _full(self) -> float:
        return self._plan.settings.full

    def _wants(self, *, idle: bool, loaded: bool) -> bool:
        """Return whether it should be on its way to a charger."""
        if self._service.is_on_its_own:
            return True
        if self._service.state is not None:
            return False
        if self._is_critical:
            return not loaded
        return idle and self._battery.level < self._plan.settings.low

    def _seek(self, *, idle: bool) -> None:
        """Claim the nearest free charger, and go once it is this robot's."""
        if self._is_critical:
            self._leave_service("seeks a free charger")
        now = self._talker.now()
        if not self._claims.charger:
            nearest = self._nearest(now)
            if nearest is not None:
                self._claims.claim(nearest, now)
                self._say()
        elif idle and self._may_go() and self._claims.settle(now):
            self._go()

    def _nearest(self, now: float) -> str | None:
        """Return the free charger with the shortest way, or None where none can be reached."""
        here = self._pose
        assert here is not None  # noqa: S101  (`start` has told)
        path_lengths = {
            name: self._path_lengths.length(here, self._plan.chargers[name])
            for name in self._claims.free(now)
            if self._avoided.get(name, now) <= now
        }
        reachable = [name for name in path_lengths if math.isfinite(path_lengths[name])]
        return min(reachable, key=lambda name: path_lengths[name], default=None)

    def _go(self) -> None:
        charger = self._claims.charger
        self._phase = Phase.GOING
        self._leave_service(f"goes to {charger}")
        self._drive(self._plan.chargers[charger], self._arrived)

    def _arrived(self, result: CommandResult) -> None:
        charger = self._claims.charger
        if result.state is CommandState.SUCCEEDED:
            self._phase = Phase.THERE
            self._leave_service(f"charges at {charger}")
        else:
            self._phase = Phase.AWAY
            self._avoided[charger] = self._talker.now() + _AVOID
            self._claims.release()
        self._changed()

    def _lease_keeper(self) -> None:
        home = self._home
        assert home is not None  # noqa: S101  (`start` has told)
        place = self._plan.chargers[self._claims.charger]
        if math.hypot(home.x - place.x, home.y - place.y) > NEAR and self._may_go():
            self._phase = Phase.LEAVING
            self._drive(home, self._left)

    def _left(self, _: CommandResult) -> None:
        self._phase = Phase.THERE if self._is_at(self._claims.charger) else Phase.AWAY

    def _drive(self, goal: Pose, ended: Callable[[CommandResult], None]) -> None:
        task = Task(f"{self._id} charging", TaskType.GA, (goal,))
        self._controller.run(task, 0, lambda _: None, ended)

    def _halt(self) -> None:
        """Stop on the way; the charger is claimed anew before the robot goes on."""
        self._controller.stop()
        if self._phase is Phase.LEAVING and self._is_at(self._claims.charger):
            self._phase = Phase.THERE
            return
        self._phase = Phase.AWAY
        self._claims.release()

    def _leave_service(self, doing: str) -> None:
        self._service.go_charging(f"its battery is at {self._battery.level:.0%}: {doing}")

    def _is_at(self, charger: str) -> bool:
        place = self._plan.chargers.get(charger)
        here = self._pose
        if place is None or here is None:
            return False
        return math.hypot(here.x - place.x, here.y - place.y) <= NEAR

    def _hear(self, claim: Claim) -> None:
        if claim.robot_id != self._id:
            if self._claims.hear(claim, self._talker.now()):
                self._say()
            self._changed()

    def _say(self) -> None:
        if self._plan.chargers and self._pose is not None:
            self._talker.publish(CHARGER_CLAIM, self._claims.say(self._pose))
