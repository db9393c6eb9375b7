# SPDX-License-Identifier: BSD-3-Clause
"""Every change of the hive in words, for the command line and for the windows' log."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING

from blackboard.domain.characteristics import RobotState
from blackboard.domain.record import TaskUpdate
from blackboard.domain.task import TaskState
from fleet_manager.client.formats import counted, member, type_name
from fleet_manager.client.leadership import Standing

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from blackboard.consensus.messages import Heartbeat
    from blackboard.domain.bid import Bid
    from blackboard.domain.record import TaskRecord
    from blackboard.domain.task import Task

_ROBOT_WORDS = {
    RobotState.IDLE: "is ready",
    RobotState.BUSY: "is at work",
    RobotState.DEFECT: "is out of service",
    RobotState.CHARGING: "is charging",
    RobotState.OFFLINE: "is offline",
}


class Severity(Enum):
    """How much attention an event needs."""

    NEWS = "news"
    """Everything goes as planned."""
    WARNING = "warning"
    """Something is in the way; the hive deals with it."""
    ALARM = "alarm"
    """A person has to look."""


@dataclass(frozen=True, slots=True)
class Event:
    """One thing that happened."""

    text: str  # a sentence without a full stop
    severity: Severity = Severity.NEWS  # how much attention it needs
    task_id: str = ""  # the task it is about; empty where it is about none


def task_words(state: TaskState, robot: str, step: int, steps: int, reason: str) -> str:
    """Return where a task stands, as the rest of a sentence that begins with its id."""
    because = f": {reason}" if reason else ""
    by = f" by {robot}" if robot else ""
    words = {
        TaskState.WAITING: f"waits for a robot{because}",
        TaskState.ASSIGNED: f"is on the list of {robot}",
        TaskState.STARTED: f"is under way{by}, {step} of {steps} steps done{because}",
        TaskState.DONE: f"is done{by}",
        TaskState.REJECTED: f"was rejected{because}",
        TaskState.CANCELLED: f"was cancelled{because}",
        TaskState.FAILED: f"has failed{by}{because}",
    }
    return words[state]


def order_words(task: Task) -> str:
    """Return what a task asks for: `GPAB (9.0, 3.0) -> (2.0, 6.5), 5 kg, priority 7`."""
    way = " -> ".join(f"({goal.x:.1f}, {goal.y:.1f})" for goal in task.goals)
    return f"{type_name(task.type)} {way}, {task.payload:g} kg, priority {task.priority}"


def task_posted(task: Task) -> Event:
    """Tell that somebody posted a task."""
    return Event(f"task {task.id[:64]} was posted: {order_words(task)}", task_id=task.id)


def task_listed(task: Task) -> Event:
    """Tell that a task is on the task list."""
    return Event(f"task {task.id} is on the list: {order_words(task)}", task_id=task.id)


def task_removed(task_id: str) -> Event:
    """Tell that a task is gone from the task list without having ended."""
    return Event(f"task {task_id} is no longer on the list", task_id=task_id)


def first_list(count: int, still_open: int) -> Event:
    """Tell in one line what the first task list holds."""
    return Event(f"{counted(count, 'task')} on the list, {still_open} open")


def update_event(update: TaskUpdate) -> Event:
    """Tell of a task that is on no list."""
    robot, step, steps = update.robot_id, update.step, update.steps
    words = task_words(update.state, robot, step, steps, update.reason)
    refused = update.state is TaskState.REJECTED
    severity = Severity.WARNING if refused else Severity.NEWS
    return Event(f"task {update.task_id[:64]} {words}", severity, update.task_id)


def task_event(record: TaskRecord, severity: Severity = Severity.NEWS) -> Event:
    """Tell where a task on the list stands."""
    words = task_words(record.state, record.robot, record.step, record.steps, record.reason)
    return Event(f"task {record.task.id} {words}", severity, record.task.id)


def task_change(
    before: TaskRecord | TaskUpdate | None,
    after: TaskRecord,
    bids: Sequence[Bid] | None = None,
) -> Iterator[Event]:
    """Tell a change of a task, where there is one; `before` is None for a new task.

    With the `bids` of its newest auction, cheapest first, it also tells who got the task at what
    cost, and a start that was never heard of. None tells the new state alone.
    """
    if before is not None and _is_same(before, after):
        return
    state = after.state
    if bids is not None and after.robot and (before is None or _robot(before) != after.robot):
        yield _assigned(after, bids)
    elif state is TaskState.ASSIGNED:
        yield task_event(after)
    has_begun = before is not None and before.state >= TaskState.STARTED
    if bids is not None and state is TaskState.DONE and after.robot and not has_begun:
        yield task_event(replace(after, state=TaskState.STARTED, step=0, reason=""))
    if state is not TaskState.ASSIGNED:
        yield task_event(after, _severity(before, after))


def _is_same(before: TaskRecord | TaskUpdate, after: TaskRecord) -> bool:
    """Return whether there is nothing to tell; robot and reason of an ended task do not count."""
    if (before.state, before.step) != (after.state, after.step):
        return False
    if after.state.is_terminal:
        return True
    same_robot = after.state is TaskState.WAITING or _robot(before) == after.robot
    return same_robot and before.reason == after.reason


def _robot(known: TaskRecord | TaskUpdate) -> str:
    return known.robot_id if isinstance(known, TaskUpdate) else known.robot


def _severity(before: TaskRecord | TaskUpdate | None, after: TaskRecord) -> Severity:
    if after.state is TaskState.FAILED:
        return Severity.ALARM
    if after.is_moved:
        return Severity.NEWS  # as planned
    was_held = before is not None and TaskState.WAITING < before.state < TaskState.DONE
    if after.state is TaskState.WAITING and (after.reason or was_held):
        return Severity.WARNING
    return Severity.NEWS


def _assigned(record: TaskRecord, bids: Sequence[Bid]) -> Event:
    """Tell who got a task, and at what cost where its bid is known."""
    text = f"task {record.task.id} is on the list of {record.robot}"
    mine = next((bid for bid in bids if bid.robot_id == record.robot), None)
    others = ", ".join(
        f"{bid.robot_id} {bid.cost:.1f}" if bid.is_able else f"{bid.robot_id} cannot"
        for bid in bids
        if bid is not mine
    )
    if mine and others:
        text += f" at cost {mine.cost:.1f} ({others})"
        if mine.cost > min(bid.cost for bid in bids):
            text += f"; `hive why {record.task.id}` says why not to the cheapest"
    return Event(text, task_id=record.task.id)


def robot_change(
    name: str, before: RobotState | None, now: RobotState, reason: str, charge: float
) -> Event:
    """Tell that a robot has changed its state, or is new.

    Args:
        name: The robot.
        before: Its state before; None if it is new.
        now: Its state.
        reason: Why it is so; may be empty.
        charge: Of its battery, 0 to 1; told of a new robot.
    """
    because = f": {reason}" if reason else ""
    battery = f", battery {charge:.0%}" if before is None else ""
    out = now in {RobotState.DEFECT, RobotState.OFFLINE}
    severity = Severity.ALARM if out else Severity.NEWS
    back = "is heard again and " if before is RobotState.OFFLINE else ""
    return Event(f"{name} {back}{_ROBOT_WORDS[now]}{because}{battery}", severity)


def leader_change(before: Heartbeat | None, now: Heartbeat) -> Iterator[Event]:
    """Tell what a heartbeat changes: leader, backup, members, the map."""
    if before is None or (before.leader, before.epoch) != (now.leader, now.epoch):
        replaced = before is not None and before.leader != now.leader
        severity = Severity.WARNING if replaced else Severity.NEWS
        yield Event(f"{member(now.leader)} is the leader, epoch {now.epoch}", severity)
    if now.backup and (before is None or before.backup != now.backup):
        yield Event(f"{member(now.backup)} is the backup")
    if before is not None:
        if now.map.differs(before.map):
            yield Event(f"{member(now.leader)} uses {now.map} now")
        for name in sorted(set(now.members) - set(before.members)):
            yield Event(f"{member(name)} joined the hive")
        for name in sorted(set(before.members) - set(now.members)):
            yield Event(f"{member(name)} left the hive")


def standing_change(before: Standing, now: Standing, beat: Heartbeat) -> Iterator[Event]:
    """Tell that the blackboard fell silent, is stuck or is back."""
    leader = member(beat.leader)
    if now is Standing.SILENT:
        yield Event(f"no leader: {leader} is silent", Severity.ALARM)
    elif now is Standing.STUCK:
        yield Event(f"no leader: {leader} answers but does not work", Severity.ALARM)
    elif now is Standing.LEADER and before is not Standing.NOBODY:
        yield Event(f"{leader} is the leader again, epoch {beat.epoch}")
