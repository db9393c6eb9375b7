# SPDX-License-Identifier: BSD-3-Clause
"""Corrects what a robot predicts of its steps by what they took."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from blackboard.costing.experience import Experience, Learned, by_formula, turning_at_ends
from blackboard.costing.regression import Regression
from blackboard.costing.saved_experience import CHANGES_KEPT, SHARES, TIMES, SavedExperience
from blackboard.costing.shift import Shift
from blackboard.costing.track_record import TrackRecord
from blackboard.domain.task import StepKind

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from blackboard.costing.track_record import Outcome
    from blackboard.domain.characteristics import RobotCharacteristics
    from hive_common.pose import Pose

    Rows = Sequence[Sequence[float]]

_SHORTEST = 0.5
"""A shorter drive says nothing [m]."""

_OF_TIME = (4.0, 1.0, 1.0)
"""How far off the formula may be [s a drive, s/m, s/rad]."""

_OF_ENERGY = (0.5, 0.5)
"""How far off it may be in what friction draws, and in what all else draws."""

_TIME_SPREAD, _ENERGY_SPREAD = 0.1, 0.05
"""By which share a step differs from the next one like it."""

_USUAL_TIME, _USUAL_ENERGY = 0.1, 0.02
"""Errors of the time of tasks, and of the energy of steps, that are no sign of a change. No step
draws more because it was held up: what was drawn is compared with the time that it took."""

_NEWS = 20
"""So many tasks after a change it is no news."""

_OF_OTHERS = 0.1
"""How far off the experience of others may be, as a share of these."""

_OF_ARM = (0.5,)
"""How far off it may be in how long the arm works, as a share."""


class Estimator:
    """Estimates what the steps of one robot take, from those that it did.

    Args:
        body: What the robot is.

    Attributes:
        experience: What it predicts by.
        record: How well it has predicted.
        clipped: How many were predicted outside of their limits.
        changes: What has changed, in words, oldest first.
    """

    def __init__(self, body: RobotCharacteristics) -> None:
        self._body = body
        self.experience = Experience(body)
        self.forget()

    @property
    def news(self) -> str:
        """What has changed within the last tasks, in words; empty if nothing has."""
        return self.changes[-1] if self.changes and self.record.settled < _NEWS else ""

    def forget(self) -> None:
        """Predict by the formula again."""
        self._begin(by_formula(self._body.max_speed), (), ())
        self.record = TrackRecord()
        self.clipped = 0
        self.changes: list[str] = []

    def _begin(self, learned: Learned, of_time: Rows, of_energy: Rows) -> None:
        self._time = Regression(learned[:TIMES], _OF_TIME, _TIME_SPREAD, of_time)
        shares = learned[TIMES : TIMES + SHARES]
        self._energy = Regression(shares, _OF_ENERGY, _ENERGY_SPREAD, of_energy)
        self._arm = {
            StepKind.PICK: Regression((learned.pick,), _OF_ARM, _TIME_SPREAD),
            StepKind.PLACE: Regression((learned.place,), _OF_ARM, _TIME_SPREAD),
        }
        self._drives = learned.drives
        self._time_shift, self._energy_shift = Shift(_USUAL_TIME), Shift(_USUAL_ENERGY)
        self._terms = np.zeros(SHARES)
        self._drawn = 0.0
        self.experience.use(learned)

    def restore(self, saved: SavedExperience) -> None:
        """Go on from what was saved."""
        self._begin(Learned(*saved.learned), saved.of_time, saved.of_energy)
        self.record = TrackRecord(saved.tasks, saved.settled)
        self.clipped = saved.clipped
        self.changes = list(saved.changes[-CHANGES_KEPT:])

    def save(self) -> SavedExperience:
        """Return what `restore` goes on from."""
        return SavedExperience(
            learned=tuple(self.experience.learned),
            of_time=self._time.covariance,
            of_energy=self._energy.covariance,
            clipped=self.clipped,
            outcomes=tuple(tuple(each) for each in self.record.outcomes),
            settled=self.record.settled,
            changes=tuple(self.changes),
        )

    def begin_with(self, others: Iterable[SavedExperience]) -> None:
        """Begin with the experience of other robots of the model, each by what it has driven."""
        known = [Learned(*each.learned) for each in others]
        weights = [max(0.0, each.drives) for each in known]
        if not any(weights):
            return
        mean = np.average(known, axis=0, weights=weights)
        of_time, of_energy = (
            tuple(map(tuple, np.diag(np.square(np.multiply(_OF_OTHERS, uncertainty))).tolist()))
            for uncertainty in (_OF_TIME, _OF_ENERGY)
        )
        self._begin(Learned(*mean.tolist()), of_time, of_energy)

    def learn_drive(
        self, start: Pose, goal: Pose, distance: float, duration: float, delay: float = 0.0
    ) -> None:
        """Learn from a drive over a distance [m] that took a time [s].

        What traffic costs, `delay` [s], comes on top of what is learned.
        """
        free = duration - delay
        if not (_SHORTEST <= distance < math.inf and free > 0.0):
            return
        self.clipped += self.experience.is_clipped(start, goal, distance)
        self._time.learn([1.0, distance, turning_at_ends(start, goal)], free)
        self._drives += 1
        self._predict()

    def learn_arm(self, kind: StepKind, duration: float) -> None:
        """Learn from a pick or a place that took a time [s]."""
        planned = self._body.arm_time(kind)
        if planned > 0.0 < duration:
            self._arm[kind].learn((planned,), duration)
            self._predict()

    def learn_energy(self, friction: float, power: float, drawn: float) -> None:
        """Learn from what was drawn from the battery in some time, without charging [J].

        A gauge may show whole percents only. Steps are taken together until it has dropped.

        Args:
            friction: What friction draws by the formula for the distance that was driven [J].
            power: What electronics and arm draw by the formula in that time [J].
            drawn: What the battery lost [J].
        """
        if not friction + power > 0.0:
            return
        self._terms += (friction, power)
        self._drawn += drawn
        if self._drawn > 0.0:
            ratio = self._energy.learn(self._terms.tolist(), self._drawn)
            self._terms[:], self._drawn = 0.0, 0.0
            if change := self._energy_shift.add(ratio):
                self._note(f"steps draw {change} energy than predicted", self._energy)
            self._predict()

    def add(self, outcome: Outcome) -> None:
        """Take in how a task went."""
        if not outcome.is_usable:
            return
        self.record.add(outcome)
        if change := self._time_shift.add(outcome.time / outcome.predicted_time):
            changed = (self._time, *self._arm.values())
            self._note(f"tasks take {change} time than predicted", *changed)
        self._predict()

    def _note(self, change: str, *changed: Regression) -> None:
        """Note what has changed, and learn it anew."""
        for regression in changed:
            regression.doubt()
        self.record.unsettle()
        self.changes = [*self.changes, f"after {self._drives:.0f} drives: {change}"][
            -CHANGES_KEPT:
        ]

    def _predict(self) -> None:
        before = self.experience.learned
        margins = (
            self.record.time_margin(before.time_margin),
            self.record.energy_margin(before.energy_margin),
        )
        together = (self._time, self._energy, *self._arm.values())
        values = [value for regression in together for value in regression.values.tolist()]
        self.experience.use(Learned._make([*values, *margins, self._drives]))
