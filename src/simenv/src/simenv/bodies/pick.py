# SPDX-License-Identifier: BSD-3-Clause
"""Picking and placing: how long it takes, what is on board afterwards, and what can go wrong.

An arm can pick anywhere. If a station of the world is within its reach, the station's stock and
duration count.

A robot carries one load. A load that is still on board at the next pick counts as taken off by
people meanwhile, because a task that ends with a pick (GPA) leaves its load on board; unless the
order says that the arm is to look first.

An arm does an order with an id once: asked for it again, it says how it ended, or goes on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

from simenv.errors import CommandError

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np

    from hive_common.pose import Pose
    from robot_description.models import RobotModel
    from simenv.world.world_content import Station

_REMEMBERED = 1000
"""Orders that an arm remembers after their end; a robot asks again only for its last."""

_SAME_STAMP = 1e-3
"""Two tasks with one id whose stamps are further apart are two tasks [s]; see Pick.action."""

STILL = 0.02  # how far the base may drift [m] and turn [rad] while the arm works


class Act(IntEnum):
    """What the arm does; numbers as in blackboard/Pick.action."""

    PICK = 0
    """Take a load on board."""
    PLACE = 1
    """Put a load down."""


class PickOutcome(IntEnum):
    """How an order ended; numbers as in blackboard/Pick.action."""

    SUCCESS = 0
    """Done."""
    TOO_HEAVY = 100
    """More than the arm can lift."""
    NOTHING_THERE = 101
    """Nothing to pick here, or nothing on board to place."""
    MOVED = 102
    """The base moved while the arm worked."""
    DROPPED = 103
    """The grip failed; the load is where it was."""
    HOLDS_ANOTHER = 104
    """The load of another task is still on board."""


@dataclass(frozen=True)
class Order:
    """An order to the arm."""

    act: Act  # pick or place
    task_id: str  # the task; a load picked for a task is placed for the same task
    payload: float  # mass of the load [kg], at least 0
    action_id: str = ""  # the same whenever the same order is given again; empty if there is none
    look: bool = False  # look first what is on board
    posted: float = 0.0  # when the task was posted [s]; 0 if unknown

    def __post_init__(self) -> None:
        """Refuse a negative or infinite load."""
        if not (math.isfinite(self.payload) and self.payload >= 0):
            raise CommandError(f"payload {self.payload} kg; allowed: a number of at least 0")


@dataclass(frozen=True)
class Load:
    """What is on board."""

    task_id: str
    payload: float
    """[kg]"""
    posted: float = 0.0
    """When the task was posted [s]; 0 if unknown."""

    def is_of(self, order: Order) -> bool:
        """Return whether an order means this load, and not that of a later task of the same id."""
        known = order.posted and self.posted
        is_one = not known or abs(order.posted - self.posted) < _SAME_STAMP
        return self.task_id == order.task_id and is_one


@dataclass(frozen=True)
class Result:
    """How an order ended, as a number and in words."""

    outcome: PickOutcome
    message: str


class Stock:
    """What is left to pick at the stations."""

    def __init__(self, stations: Sequence[Station]) -> None:
        """Fill the stations as the world says."""
        self._stations = stations
        self.refill()

    def refill(self) -> None:
        """Restore the stock of the start."""
        self._left = {station.name: station.stock for station in self._stations}

    def near(self, pose: Pose, reach: float) -> Station | None:
        """Return the nearest station within `reach` [m] of a base at `pose`, or None."""
        distances = [
            (math.dist(station.pose[:2], pose[:2]), index)
            for index, station in enumerate(self._stations)
        ]
        distance, index = min(distances, default=(math.inf, 0))
        return self._stations[index] if distance <= reach else None

    def empty(self, station: Station) -> bool:
        """Return whether nothing is left at a station."""
        return self._left[station.name] == 0

    def change(self, station: Station, by: int) -> None:
        """Add to the stock of a station, or take from it."""
        left = self._left[station.name]
        if left is not None:
            self._left[station.name] = left + by


class Arm:
    """The arm of one robot: at most one order at a time.

    Attributes:
        progress: Of the current or last order, 0..1.
        result: How the last order ended; None while one is under way, and before the first.
        load: What is on board, or None.
        failures: Probability that a grip fails, 0..1.
        fail_next: Number of next grips that fail in any case.
    """

    def __init__(
        self, model: RobotModel, stock: Stock, random: np.random.Generator, failures: float = 0.0
    ) -> None:
        """Take the arm of a model, which may have none; see `can_pick`."""
        self._random = random
        self.failures = failures
        self.fail_next = 0
        self._model = model
        self._stock = stock
        self._order: Order | None = None
        self._done: dict[str, Result] = {}
        self._station: Station | None = None
        self._start: Pose | None = None
        self._duration = 0.0
        self._elapsed = 0.0
        self.result: Result | None = None
        self.load: Load | None = None

    @property
    def can_pick(self) -> bool:
        """Whether the robot has an arm."""
        return self._model.arm is not None

    @property
    def payload(self) -> float:
        """What is on board [kg]."""
        return self.load.payload if self.load else 0.0

    @property
    def progress(self) -> float:
        """Share of the order that is done, 0..1."""
        return min(self._elapsed / self._duration, 1.0) if self._duration else 0.0

    @property
    def busy(self) -> bool:
        """Whether an order is under way."""
        return self._order is not None

    def start(self, order: Order, pose: Pose) -> None:
        """Start an order with the base at `pose`, frame map, or refuse it with a `result`.

        Raises:
            CommandError: The robot has no arm, or its arm is busy.
        """
        arm = self._model.arm
        if arm is None:
            raise CommandError(f"the model {self._model.name} has no arm; send another robot")
        if self.busy:
            raise CommandError("the arm is busy; wait for its result or cancel it")
        self._station = self._stock.near(pose, arm.reach)
        own = arm.pick_duration if order.act is Act.PICK else arm.place_duration
        given = self._station.duration if self._station and order.act is Act.PICK else None
        self._duration = given or own
        self._elapsed = 0.0
        self._start = pose
        self.result = self._known(order) or self._refusal(order, arm.payload)
        self._order = order if self.result is None else None

    def is_at(self, order: Order) -> bool:
        """Return whether an order with this one's id is under way."""
        return self._order is not None and "" != order.action_id == self._order.action_id

    def _known(self, order: Order) -> Result | None:
        """Return the result of an order that needs no move of the arm; None if it needs one."""
        if order.action_id in self._done:
            return self._done[order.action_id]
        if order.act is Act.PICK and order.look and self.load:
            if self.load.is_of(order):
                return Result(PickOutcome.SUCCESS, "on board already")
            what = f"{_words(self.load, order)} is still on board"
            return Result(PickOutcome.HOLDS_ANOTHER, what)
        return None

    def _refusal(self, order: Order, limit: float) -> Result | None:
        if order.act is Act.PLACE:
            if self.load and self.load.is_of(order):
                return None
            on_board = _words(self.load, order) if self.load else "nothing"
            return Result(
                PickOutcome.NOTHING_THERE,
                f"{on_board} is on board, not the load of task '{order.task_id}'",
            )
        if order.payload > limit:
            return Result(
                PickOutcome.TOO_HEAVY, f"{order.payload:g} kg is over the arm's {limit:g} kg"
            )
        if self._station and self._stock.empty(self._station):
            return Result(PickOutcome.NOTHING_THERE, f"nothing is left at '{self._station.name}'")
        return None

    def cancel(self) -> None:
        """Drop the current order; what is on board stays."""
        self._order = None

    def step(self, pose: Pose, dt: float) -> None:
        """Continue the current order for `dt` [s], with the base at `pose`, frame map."""
        if self._order is None or self._start is None:
            return
        turned = abs(math.remainder(pose.yaw - self._start.yaw, math.tau))
        if max(math.dist(pose[:2], self._start[:2]), turned) > STILL:
            self._end(PickOutcome.MOVED, "the base moved while the arm worked")
            return
        self._elapsed += dt
        if self._elapsed >= self._duration - dt / 2:
            self._finish(self._order)

    def reset(self) -> None:
        """Return to an empty arm at rest."""
        self._order = self.result = self.load = None
        self._done.clear()
        self.fail_next = 0

    def _finish(self, order: Order) -> None:
        if self._fails():
            self._end(PickOutcome.DROPPED, "the grip failed; the load is where it was; try again")
            return
        where = f"at '{self._station.name}'" if self._station else "at a free place"
        picked = order.act is Act.PICK
        self.load = Load(order.task_id, order.payload, order.posted) if picked else None
        if self._station:
            self._stock.change(self._station, -1 if picked else 1)
        self._end(PickOutcome.SUCCESS, f"{'picked' if picked else 'put down'} {where}")
        if order.action_id and self.result is not None:
            self._done[order.action_id] = self.result
            for oldest in list(self._done)[:-_REMEMBERED]:
                del self._done[oldest]

    def _fails(self) -> bool:
        """Return whether this grip fails; draw a random number only if it matters."""
        if self.fail_next:
            self.fail_next -= 1
            return True
        return self.failures > 0 and self._random.random() < self.failures

    def _end(self, outcome: PickOutcome, message: str) -> None:
        self._order = None
        self.result = Result(outcome, message)


def _words(load: Load, order: Order) -> str:
    """Return the words for a load that an order does not mean."""
    which = "another task" if load.task_id == order.task_id else "task"
    return f"the load of {which} '{load.task_id}'"
