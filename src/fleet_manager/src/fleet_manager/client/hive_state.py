# SPDX-License-Identifier: BSD-3-Clause
"""The hive as a desk knows it: tasks, robots, who carries the blackboard.

`Hive.apply` takes one fact after the other, in whatever order the topics deliver them; what
changed is collected until `take_changes`, so that a window redraws what changed and no more. The
task list of the active blackboard is the truth; changes told by robots in between only make the
desk quicker, and the next list corrects them. A takeover therefore needs nothing special.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.costing.bid_basis import Bids
from blackboard.domain.characteristics import RobotStatus
from blackboard.domain.record import TaskRecord, TaskUpdate
from blackboard.domain.task import TaskState
from fleet_manager.desk.authority import Authority, Standing
from fleet_manager.desk.bid_book import BidBook
from fleet_manager.desk.events import Log
from fleet_manager.desk.facts import LinkChange, Noted, Told
from fleet_manager.desk.rows import Changes, RobotRow, TaskRow, due

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.domain.bid import Bid
    from blackboard.domain.task import Task
    from fleet_manager.desk.events import Event
    from fleet_manager.desk.facts import Fact, Moment, Report

ROBOT_SILENCE = 5.0  # [s, wall]; a robot reports once a second
MAX_AT_ONCE = 400  # tasks told as changed together, so that a window serves keys in between
REMEMBERED = 200  # posted tasks whose content is kept until the hive answers, and refused ones


class Hive:
    """Tasks, robots and who carries the blackboard.

    Attributes:
        authority: Who carries the blackboard.
    """

    def __init__(self) -> None:
        self.authority = Authority()
        self._tasks: dict[str, TaskRow] = {}
        self._robots: dict[str, RobotRow] = {}
        self._bids = BidBook()
        self._posted: dict[str, Task] = {}
        self._version: tuple[int, int] | None = None
        self._doubtful: tuple[TaskList, float] | None = None
        self._standing = Standing.NOBODY
        self._log = Log()
        self._changes = Changes()

    @property
    def tasks(self) -> Mapping[str, TaskRow]:
        """Every task, in the order of the list, refused ones last."""
        return self._tasks

    @property
    def robots(self) -> Mapping[str, RobotRow]:
        """Every robot that has been heard of."""
        return self._robots

    def record(self, task_id: str) -> TaskRecord | None:
        """Return what was posted under an id and where it stands; None where it is not known."""
        row = self._tasks.get(task_id)
        return row.record if row else None

    def bids(self, task_id: str) -> tuple[Bid, ...]:
        """Return the bids of the last auction of a task, cheapest first."""
        return self._bids.of(task_id)

    def auctions(self, task_id: str) -> int:
        """Return in how many auctions a task has been seen, those for improvement included."""
        return self._bids.auctions(task_id)

    def posted(self, task_id: str) -> Task | None:
        """Return what was posted under an id, if it has been seen."""
        row = self._tasks.get(task_id)
        return row.record.task if row else self._posted.get(task_id)

    def apply(self, fact: Fact, now: Moment) -> None:
        """Take a fact in; facts that are none of the hive's (a click) change nothing."""
        if isinstance(fact, LinkChange):
            self.note(self._log.link(fact))
        elif isinstance(fact, Noted):
            self._changes.tasks.update(self._bids.add(fact.decision))
        elif isinstance(fact, Told):
            self._apply_report(fact.report, fact.stamp, now)

    def tick(self, now: Moment) -> None:
        """Notice who has gone silent; call it a few times a second."""
        for name, row in self._robots.items():
            silence = now.wall - row.heard
            if not row.is_silent and silence > ROBOT_SILENCE:
                self._robots[name] = replace(row, is_silent=True)
                self._changes.robots.add(name)
                self.note(self._log.robot_lost(name, silence))
        self._note_standing(now)

    def take_changes(self) -> Changes:
        """Return what changed since the last call, of a long list no more than a part."""
        changes, later = self._changes, set[str]()
        if len(changes.tasks) > MAX_AT_ONCE:
            listed = [name for name in self._tasks if name in changes.tasks]
            later = set(listed[MAX_AT_ONCE:])
            changes.tasks -= later
        self._changes = Changes(tasks=later)
        return changes

    def note(self, event: Event | None) -> None:
        """Put a line into the log; None puts none."""
        if event is not None:
            self._changes.events.append(event)

    def _apply_report(self, report: Report, stamp: float, now: Moment) -> None:
        if isinstance(report, TaskList):
            self._apply_list(report, stamp, now)
        elif isinstance(report, TaskUpdate):
            self._apply_update(report, stamp)
        elif isinstance(report, RobotStatus):
            self._apply_status(report, now)
        elif isinstance(report, Heartbeat):
            self._apply_heartbeat(report, now)
        elif isinstance(report, Bids):
            self._changes.tasks.update(self._bids.add(report))
        else:
            self._apply_posted(report)

    def _apply_list(self, told: TaskList, stamp: float, now: Moment) -> None:
        version = (told.epoch, told.version)
        is_old = self._version is not None and version <= self._version
        someone = self.authority.standing(now) is Standing.LEADER
        if someone and (is_old or told.epoch < self.authority.epoch):
            # It may be the first list of a hive that was started anew; its heartbeat will tell.
            self._doubtful = (told, stamp)
            return
        is_first, self._version = self._version is None, version
        before, self._tasks = self._tasks, {}
        # The clock of a hive that was started anew may have been set back.
        newer = set() if is_first or is_old else _told_after(stamp, before)
        for record in told.records:
            name = record.task.id
            row = before.pop(name, None)
            if row is None or (name not in newer and row.record != record):
                row = self._listed(row, record, stamp, quiet=is_first)
            self._tasks[name] = row
        self._keep_unlisted(before, newer)
        if is_first and told.records:
            still_open = sum(not record.state.is_terminal for record in told.records)
            self.note(self._log.first_list(len(told.records), still_open))

    def _listed(
        self, before: TaskRow | None, record: TaskRecord, stamp: float, *, quiet: bool
    ) -> TaskRow:
        """Return the row for a record of the list that tells something new."""
        self._changes.tasks.add(record.task.id)
        if not quiet:
            self._note_task(before, record)
        return TaskRow(record, due(record, stamp), stamp)

    def _keep_unlisted(self, unlisted: Mapping[str, TaskRow], newer: set[str]) -> None:
        """Of the rows that are not on the list, keep the newer ones and the last refused ones."""
        refused = [
            name for name, row in unlisted.items() if row.record.state is TaskState.REJECTED
        ]
        kept = newer.union(refused[-REMEMBERED:])
        for name, row in unlisted.items():
            if name in kept:
                self._tasks[name] = row
                continue
            self._changes.tasks.add(name)
            self._bids.forget(name)
            self._posted.pop(name, None)
            if not row.record.state.is_terminal:
                self.note(self._log.removed(name))

    def _apply_update(self, update: TaskUpdate, stamp: float) -> None:
        if update.state is TaskState.REJECTED:
            self._apply_refusal(update, stamp)
            return
        row, task = self._tasks.get(update.task_id), self.posted(update.task_id)
        is_old = update.epoch < self.authority.epoch or (row and row.stamp > stamp)
        if task is None or is_old:
            return
        before = row.record if row else TaskRecord(task)
        waits = update.state is TaskState.WAITING
        record = replace(
            before,
            state=update.state,
            robot="" if waits else update.robot_id or before.robot,
            step=update.step,
            eta=update.eta,
            reason=update.reason,
        )
        if row is None or record != before:
            self._tasks[update.task_id] = TaskRow(record, due(record, stamp), stamp)
            self._changes.tasks.add(update.task_id)
            self._note_task(row, record)

    def _apply_refusal(self, update: TaskUpdate, stamp: float) -> None:
        name = update.task_id
        self.note(self._log.refused(name, update.reason))
        task, row = self._posted.get(name), self._tasks.get(name)
        if task is None or (row and row.record.state is not TaskState.REJECTED):
            return  # a second task under a taken id: the first one stands as it is
        record = TaskRecord(task, TaskState.REJECTED, reason=update.reason)
        self._tasks[name] = TaskRow(record, None, stamp)
        self._changes.tasks.add(name)

    def _note_task(self, before: TaskRow | None, record: TaskRecord) -> None:
        bids = self.bids(record.task.id)
        for event in self._log.task(before.record if before else None, record, bids):
            self.note(event)

    def _apply_status(self, status: RobotStatus, now: Moment) -> None:
        before = self._robots.get(status.robot_id)
        self._robots[status.robot_id] = RobotRow(status, now.wall)
        if before is None or before.is_silent or before.status != status:
            self._changes.robots.add(status.robot_id)
        self.note(self._log.robot(before.status if before else None, status))
        if before and before.is_silent:
            self.note(self._log.robot_back(status.robot_id))

    def _apply_heartbeat(self, beat: Heartbeat, now: Moment) -> None:
        before = self.authority.heartbeat
        if not self.authority.hear(beat, now):
            return
        for event in self._log.heartbeat(before, beat):
            self.note(event)
        if before and (beat.epoch, beat.progress) < (before.epoch, before.progress):
            self._version = None  # a hive that was started anew counts anew
            if self._doubtful:
                told, stamp = self._doubtful
                self._apply_list(told, stamp, now)
        self._doubtful = None
        self._note_standing(now)

    def _note_standing(self, now: Moment) -> None:
        standing = self.authority.standing(now)
        if standing is not self._standing and self.authority.heartbeat:
            before, self._standing = self._standing, standing
            self.note(self._log.standing(before, standing, self.authority.heartbeat))

    def _apply_posted(self, task: Task) -> None:
        is_new = task.id not in self._posted and task.id not in self._tasks
        self._posted.pop(task.id, None)
        self._posted[task.id] = task
        if len(self._posted) > REMEMBERED:
            del self._posted[next(iter(self._posted))]
        if is_new:
            self.note(self._log.posted(task))


def _told_after(stamp: float, rows: Mapping[str, TaskRow]) -> set[str]:
    """Return the ids of tasks of which was told after a list was written; the next one knows."""
    refused = TaskState.REJECTED
    return {
        name for name, row in rows.items() if row.stamp > stamp and row.record.state is not refused
    }
