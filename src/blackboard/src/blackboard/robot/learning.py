# SPDX-License-Identifier: BSD-3-Clause
"""Watches what a robot's steps and tasks take, learns from it, and keeps what was learned."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from blackboard.costing.cost import friction_force
from blackboard.costing.effort import Predictor
from blackboard.costing.estimator import Estimator
from blackboard.costing.saved_experience import as_plain, saved_from
from blackboard.costing.track_record import Outcome
from blackboard.domain.battery import SECONDS_PER_HOUR
from blackboard.domain.task import StepKind
from blackboard.errors import JournalError
from hive_common.structuring import NotAllowedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from blackboard.consensus.journal import Journal
    from blackboard.costing.effort import Effort
    from blackboard.costing.experience import Experience
    from blackboard.costing.saved_experience import SavedExperience
    from blackboard.domain.battery import Battery
    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.talker import Talker
    from blackboard.domain.task import Task, TaskStep
    from hive_common.pose import Pose


@dataclass(frozen=True)
class _Begun:
    """What was so when a task or a step began."""

    at: float  # the time [s]
    charge: float  # left in the battery [Ah]


@dataclass(frozen=True)
class _Predicted:
    """What was predicted of a task when it began."""

    task_id: str
    begun: _Begun
    formula: Effort
    learned: Effort
    most_time: float  # [s]
    most_energy: float  # [J]


class Learning:
    """Learns for one robot; see `costing.estimator.Estimator`.

    Args:
        talker: The robot's; outcomes are timed by its clock of the world.
        robot_id: The robot's name.
        body: What the robot is.
        battery: Tells what the robot draws.
        path_lengths: Tell how far it drives.
        journal: Keeps what is learned.
    """

    def __init__(
        self,
        talker: Talker,
        robot_id: str,
        body: RobotCharacteristics,
        battery: Battery,
        path_lengths: PathLengths,
        journal: Journal,
    ) -> None:
        self._tell: Callable[[SavedExperience], None] = lambda _: None
        self._talker = talker
        self._id = robot_id
        self._body = body
        self._battery = battery
        self._path_lengths = path_lengths
        self._journal = journal
        self._estimator = Estimator(body)
        self._formula = Predictor(body, path_lengths)
        self._predictor = Predictor(body, path_lengths, self.experience)
        self._predicted: _Predicted | None = None
        self._restore()
        self._changes = tuple(self._estimator.changes)

    @property
    def experience(self) -> Experience:
        """What the robot predicts by."""
        return self._estimator.experience

    @property
    def news(self) -> str:
        """What has changed lately, in words; empty if nothing has."""
        return self._estimator.news

    def _restore(self) -> None:
        content = self._journal.load_experience()
        if content is None:
            return
        try:
            self._estimator.restore(saved_from(content))
        except NotAllowedError as error:
            self._talker.warn(f"{self._id} learns anew: its journal cannot be used: {error}")

    def tell_to(self, tell: Callable[[SavedExperience], None]) -> None:
        """Call a function with what has been learned, now and after every task."""
        self._tell = tell
        tell(self._estimator.save())

    def begin_with(self, others: Iterable[SavedExperience]) -> None:
        """Begin with the experience of other robots of the model, unless it has its own."""
        if self._estimator.experience.is_formula:
            self._estimator.begin_with(others)

    def forget(self) -> None:
        """Predict by the formula again."""
        self._estimator.forget()
        self._keep()

    def time_step(self, step: TaskStep, start: Pose, load: float) -> Callable[[], None]:
        """Return what is to be called if a step that begins now succeeds.

        Args:
            step: What the robot does.
            start: Where it begins, frame map.
            load: What is on board [kg].
        """
        begun = self._now()

        def done() -> None:
            taken, drawn = self._since(begun)
            if step.kind is StepKind.MOVE:
                distance, delay = self._path_lengths.length_and_delay(start, step.goal)
                self._estimator.learn_drive(start, step.goal, distance, taken, delay)
                force = friction_force(self._body.friction_coefficient, self._body.mass + load)
                self._learn_energy(force * distance, self._body.idle_power * taken, drawn)
            else:
                self._estimator.learn_arm(step.kind, taken)
                power = self._body.arm_power + self._body.idle_power
                self._learn_energy(0.0, power * taken, drawn)

        return done

    def _learn_energy(self, friction: float, power: float, drawn: float) -> None:
        # What is reckoned by the formula says nothing about the formula.
        if self._battery.IS_MEASURED and math.isfinite(friction):
            self._estimator.learn_energy(friction, power, drawn)

    def begin_task(self, task: Task, step: int, here: Pose) -> None:
        """Note what is predicted of a task that begins, or goes on, with a step."""
        learned = self._predictor.effort(task, step, here)
        self._predicted = _Predicted(
            task.id,
            self._now(),
            self._formula.effort(task, step, here),
            learned,
            self.experience.most_time(learned.duration),
            self.experience.most_energy(learned.energy),
        )

    def end_task(self, task_id: str) -> None:
        """Compare what was predicted of a task with what it took."""
        known, self._predicted = self._predicted, None
        if known is None or known.task_id != task_id:
            return
        taken, drawn = self._since(known.begun)
        outcome = Outcome(
            self._talker.date(),
            known.formula.duration,
            known.learned.duration,
            known.most_time,
            taken,
            known.formula.energy,
            known.learned.energy,
            known.most_energy,
            drawn,
        )
        self._estimator.add(outcome)
        self._tell_changes()
        self._keep()

    def _tell_changes(self) -> None:
        """Tell what has changed since the last time to who runs the robot."""
        for change in self._estimator.changes:
            if change not in self._changes:
                self._talker.warn(
                    f"{self._id}: {change}; check its wheels, its load and the floor, and whether "
                    "its ways have changed"
                )
        self._changes = tuple(self._estimator.changes)

    def _now(self) -> _Begun:
        return _Begun(self._talker.world.now(), self._battery.charge_left)

    def _since(self, begun: _Begun) -> tuple[float, float]:
        """Return the time [s] and the energy [J] since something began."""
        now = self._now()
        volts = self._battery.get_volts()
        return now.at - begun.at, (begun.charge - now.charge) * SECONDS_PER_HOUR * volts

    def _keep(self) -> None:
        saved = self._estimator.save()
        try:
            self._journal.save_experience(as_plain(saved))
        except JournalError as error:
            self._talker.warn(f"{self._id} will not remember what it has learned: {error}")
        self._tell(saved)
