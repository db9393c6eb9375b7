# SPDX-License-Identifier: BSD-3-Clause
"""What happened in the hive, in words for a person."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from blackboard.domain.characteristics import RobotState
from blackboard.domain.task import TaskState, TaskType
from fleet_manager.desk.authority import Standing
from fleet_manager.desk.facts import LinkState
from fleet_manager.desk.formats import duration, member
from fleet_manager.desk.words import text

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from blackboard.consensus.messages import Heartbeat
    from blackboard.domain.bid import Bid
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import TaskRecord
    from blackboard.domain.task import Task
    from fleet_manager.desk.facts import LinkChange


class Weight(Enum):
    """How much a person should mind."""

    NEWS = "news"
    """Things go their way."""
    WARNING = "warning"
    """Something is in the way; the hive deals with it."""
    ALARM = "alarm"
    """A person has to look."""


@dataclass(frozen=True, slots=True)
class Event:
    """One line of the log.

    Attributes:
        text: What happened.
        weight: How much a person should mind.
    """

    text: str
    weight: Weight = Weight.NEWS


class Log:
    """Puts what happened into words. It remembers nothing."""

    def posted(self, task: Task) -> Event:
        """Return the line for a task that somebody posted."""
        try:
            kind = TaskType(task.type).name
        except ValueError:
            kind = str(task.type)
        words = text("log.posted", id=task.id[:64], type=kind, priority=task.priority)
        return Event(words)

    def first_list(self, count: int, still_open: int) -> Event:
        """Return the line for the first task list that a desk sees."""
        return Event(text("log.first_list", count=count, open=still_open))

    def removed(self, task_id: str) -> Event:
        """Return the line for a task that the blackboard has forgotten."""
        return Event(text("log.removed", id=task_id))

    def refused(self, task_id: str, reason: str) -> Event:
        """Return the line for a task that was not taken in."""
        reason = reason or text("sent.no_reason")
        return Event(text("log.REJECTED", id=task_id[:64], reason=reason), Weight.WARNING)

    def task(
        self, before: TaskRecord | None, after: TaskRecord, bids: Sequence[Bid] = ()
    ) -> Iterator[Event]:
        """Give the lines for a change of a task.

        What was missed in between is told as well: the word that a task was given to a robot, or
        that the robot has started, may come late or never. So the log tells by whom and why.

        Args:
            before: As it was; None when it is new.
            after: As it is.
            bids: Of its last auction, cheapest first.
        """
        name, state = after.task.id, after.state
        was = before.robot if before else ""
        if before and before.state is state and was == after.robot:
            yield from self._within(before, after)
            return
        if state is TaskState.WAITING:
            yield self._waits(before, after)
            return
        if after.robot and (after.robot != was or state is TaskState.ASSIGNED):
            yield self._assigned(after, bids)
        begun = before is not None and before.state >= TaskState.STARTED
        if state is TaskState.DONE and after.robot and not begun:
            yield Event(text("log.STARTED", id=name, robot=after.robot))
        if state is not TaskState.ASSIGNED:
            reason = after.reason or text("sent.no_reason")
            words = text(f"log.{state.name}", id=name, robot=after.robot, reason=reason)
            yield Event(words, Weight.ALARM if state is TaskState.FAILED else Weight.NEWS)

    def _within(self, before: TaskRecord, after: TaskRecord) -> Iterator[Event]:
        """Give the line for a change that leaves the state as it is."""
        name = after.task.id
        if after.state is TaskState.STARTED and after.step > before.step:
            step, steps = after.step, after.steps
            yield Event(text("log.step", robot=after.robot, step=step, steps=steps, id=name))
        if after.state is TaskState.WAITING and after.reason and after.reason != before.reason:
            yield Event(text("log.waits_because", id=name, reason=after.reason), Weight.WARNING)

    def _waits(self, before: TaskRecord | None, after: TaskRecord) -> Event:
        name = after.task.id
        if after.reason:
            return Event(text("log.waits_because", id=name, reason=after.reason), Weight.WARNING)
        if before and before.robot:
            words = text("log.handed_back", id=name, robot=before.robot)
            return Event(words, Weight.WARNING)
        return Event(text("log.WAITING", id=name))

    def _assigned(self, after: TaskRecord, bids: Sequence[Bid]) -> Event:
        name, robot = after.task.id, after.robot
        mine = next((bid for bid in bids if bid.robot_id == robot), None)
        if mine is None:
            return Event(text("log.ASSIGNED", id=name, robot=robot))
        others = ", ".join(
            text(
                "log.other_bid" if bid.is_able else "log.other_refuses",
                robot=bid.robot_id,
                cost=bid.cost,
            )
            for bid in bids
            if bid.robot_id != robot
        )
        if not others:
            return Event(text("log.ASSIGNED", id=name, robot=robot))
        cost = mine.cost
        return Event(text("log.assigned_by_cost", id=name, robot=robot, cost=cost, others=others))

    def robot(self, before: RobotStatus | None, after: RobotStatus) -> Event | None:
        """Return the line for a robot's report, or None where its state is the same."""
        if before and before.state is after.state:
            return None
        out = after.state in {RobotState.DEFECT, RobotState.OFFLINE}
        key = "log.robot_new" if before is None else "log.robot_state"
        if after.reason and before is not None:
            key = "log.robot_because"
        state = text(f"robot.{after.state.name}")
        words = text(key, robot=after.robot_id, state=state, reason=after.reason)
        return Event(words, Weight.ALARM if out else Weight.NEWS)

    def robot_lost(self, robot: str, silence: float) -> Event:
        """Return the line for a robot that stopped reporting `silence` seconds ago."""
        words = text("log.robot_lost", robot=robot, silence=duration(silence))
        return Event(words, Weight.ALARM)

    def robot_back(self, robot: str) -> Event:
        """Return the line for a robot that reports again."""
        return Event(text("log.robot_back", robot=robot))

    def heartbeat(self, before: Heartbeat | None, after: Heartbeat) -> Iterator[Event]:
        """Give the lines for a change of who carries the blackboard."""
        leader, epoch = member(after.leader), after.epoch
        if before is None:
            yield Event(text("log.leader", leader=leader, epoch=epoch))
        elif before.leader != after.leader:
            dead = member(before.leader)
            words = text("log.taken_over", leader=leader, before=dead, epoch=epoch)
            yield Event(words, Weight.WARNING)
        elif before.epoch != epoch:
            yield Event(text("log.leader", leader=leader, epoch=epoch))
        if before is None or before.backup != after.backup:
            key = "log.backup" if after.backup else "log.no_backup"
            yield Event(text(key, backup=member(after.backup)))

    def standing(self, before: Standing, after: Standing, beat: Heartbeat) -> Event | None:
        """Return the line for a blackboard that fell silent, got stuck or is back."""
        leader = member(beat.leader)
        if after is Standing.SILENT:
            return Event(text("log.silent", leader=leader), Weight.ALARM)
        if after is Standing.STUCK:
            return Event(text("log.stuck", leader=leader), Weight.ALARM)
        if after is Standing.LEADER and before is not Standing.NOBODY:
            return Event(text("log.heard_again", leader=leader, epoch=beat.epoch))
        return None

    def link(self, change: LinkChange) -> Event | None:
        """Return the line for a ROS master that came or went."""
        if change.state is LinkState.UP:
            return Event(text("log.link_up", master=change.master))
        if change.state is LinkState.LOST:
            return Event(text("log.link_lost", master=change.master), Weight.WARNING)
        return None

    def asked_cancel(self, task_id: str) -> Event:
        """Return the line for a cancellation that was asked for here."""
        return Event(text("log.asked_cancel", id=task_id))

    def asked_state(self, robot: str, state: RobotState) -> Event:
        """Return the line for a robot state that was asked for here."""
        words = text("log.asked_state", robot=robot, state=text(f"robot.{state.name}"))
        return Event(words)
