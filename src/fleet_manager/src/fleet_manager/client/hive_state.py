# SPDX-License-Identifier: BSD-3-Clause
"""What a program outside the hive knows of it: tasks, robots, bids, and who leads.

`HiveState.take_in` takes one report after the other, in whatever order the topics deliver them.
What changed is collected until `take_changes`, so that a window redraws what changed and no more.

The blackboard's task list is the truth and comes whole; updates only make the picture newer until
the next list. A list older than one seen already is dropped, because lists may overtake each other
when the leader changes. A hive that was bootstrapped anew has another id, and its list counts.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.costing.bid_basis import Bids
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskRecord, TaskUpdate
from blackboard.domain.task import Task, TaskState
from fleet_manager.client import words
from fleet_manager.client.bids import BidBook
from fleet_manager.client.formats import duration
from fleet_manager.client.leadership import Leadership, Standing
from fleet_manager.client.rows import Changes, RobotRow, TaskRow
from fleet_manager.client.traffic import TrafficState, traffic_change

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.auction.decision import Decision
    from fleet_manager.client.reports import Report

ROBOT_SILENCE = 5.0  # [s, wall]; a robot reports once a second
PLANNER_SILENCE = 10.0  # [s, wall]; the traffic planner tells its state once a second
MAX_AT_ONCE = 400  # tasks reported as changed together, so that a window serves keys in between
MAX_REMEMBERED = 200  # posted tasks kept until the hive answers; refused tasks that are shown
MAX_ANSWERS = 10_000  # last words on tasks that are on no list; the oldest make way


class HiveState:
    """The picture of a hive that grows with every report. Not for several threads.

    If `detailed`, events tell costs and missed steps, and the first list in one line, as suits a
    log that starts in the middle; otherwise each report is told for itself.
    """

    def __init__(self, *, detailed: bool = False) -> None:
        self.leadership = Leadership()  # who is the leader
        self.bid_book = BidBook()  # the bids on every task
        self._detailed = detailed
        self._tasks: dict[str, TaskRow] = {}
        self._robots: dict[str, RobotRow] = {}
        self._answers: dict[str, TaskUpdate] = {}
        self._posted: dict[str, Task] = {}
        self._newest: TaskList | None = None
        self.list_stamp = 0.0  # when the newest task list was written [s, hive's time]; 0: unknown
        self.traffic: TrafficState | None = None  # the planner's last word; None before the first
        self.planner_is_silent = False  # whether a traffic planner was heard and no longer is
        self._traffic_heard = 0.0  # [s, wall]
        self._standing = Standing.NOBODY
        self._changes = Changes()

    @property
    def tasks(self) -> Mapping[str, TaskRow]:
        """Every task in the order of the list, refused ones last."""
        return self._tasks

    @property
    def robots(self) -> Mapping[str, RobotRow]:
        """Every robot that has been heard of."""
        return self._robots

    @property
    def heartbeat(self) -> Heartbeat | None:
        """The leader's newest heartbeat; None before the first."""
        return self.leadership.heartbeat

    @property
    def has_list(self) -> bool:
        """Whether a task list has come."""
        return self._newest is not None

    @property
    def listed(self) -> dict[str, TaskRecord]:
        """The records of the newest task list as it came, by id."""
        return {each.task.id: each for each in self._newest.records} if self._newest else {}

    @property
    def records(self) -> dict[str, TaskRecord]:
        """The newest that is known of the tasks on the list, by id, in the order of the list."""
        rows = self._tasks.items()
        return {name: row.record for name, row in rows if not row.is_refused}

    def record(self, task_id: str) -> TaskRecord | None:
        """Return the record of a task on the list, or of one that was refused."""
        row = self._tasks.get(task_id)
        return row.record if row else None

    def last_word(self, task_id: str) -> TaskRecord | TaskUpdate | None:
        """Return the newest that is known of a task, also of one that has left the list."""
        return self.record(task_id) or self._answers.get(task_id)

    def state_of(self, task_id: str) -> TaskState | None:
        """Return the state of a task, or None where the hive has said nothing of it."""
        known = self.last_word(task_id)
        return known.state if known else None

    def posted(self, task_id: str) -> Task | None:
        """Return the task that was posted under an id, if it has been seen."""
        row = self._tasks.get(task_id)
        return row.record.task if row else self._posted.get(task_id)

    def take_in(self, report: Report, now: float = 0.0, stamp: float = 0.0) -> None:
        """Update the picture by a report; one of the simulator changes nothing.

        `now` is the time [s, wall], `stamp` when it was said [s, hive's time]; 0 where unknown.
        """
        if isinstance(report, TaskList):
            self._take_list(report, stamp)
        elif isinstance(report, TaskUpdate):
            self._take_update(report, stamp)
        elif isinstance(report, RobotStatus):
            self._take_status(report, now)
        elif isinstance(report, Heartbeat):
            self._take_heartbeat(report, now)
        elif isinstance(report, Bids):
            self.add_bids(report)
        elif isinstance(report, Task):
            self._take_posted(report)
        elif isinstance(report, TrafficState):
            self._take_traffic(report, now)

    def take_changes(self) -> Changes:
        """Return what changed since the last call; of a long list only a part at a time."""
        changes, later = self._changes, set[str]()
        if len(changes.tasks) > MAX_AT_ONCE:
            listed = [name for name in self._tasks if name in changes.tasks]
            later = set(listed[MAX_AT_ONCE:])
            changes.tasks -= later
        self._changes = Changes(tasks=later)
        return changes

    def note(self, *events: words.Event) -> None:
        """Add events that this program knows of by itself."""
        self._changes.events += events

    def add_bids(self, answer: Bids | Decision) -> None:
        """Take in a robot's bids, or all bids of a recorded decision."""
        self._changes.tasks.update(self.bid_book.add(answer))

    def tick(self, now: float) -> None:
        """Notice who has gone silent; call it a few times a second."""
        for name, row in list(self._robots.items()):
            if not row.is_silent and now - row.heard > ROBOT_SILENCE:
                self._put_robot(name, replace(row, is_silent=True), now)
        if self.traffic is not None and now - self._traffic_heard > PLANNER_SILENCE:
            self.traffic, self.planner_is_silent = None, True
            self._show_waits(TrafficState(0, 0.0))
            text = "the traffic planner is silent; robots drive by right of way"
            self.note(words.Event(text, words.Severity.WARNING))
        self._note_standing(now)

    def _take_list(self, task_list: TaskList, stamp: float) -> None:
        newest, self._newest = self._newest, task_list
        if newest and task_list.is_before(newest):
            self._newest = newest
            return
        self.list_stamp = stamp
        before, self._tasks = self._tasks, {}
        # The clock of another hive may have been set back, and it owes nothing to the old one.
        goes_on = newest is not None and newest.hive == task_list.hive
        newer = _written_after(stamp, before) if goes_on else set[str]()
        for record in task_list.records:
            name = record.task.id
            row = before.pop(name, None)
            known = row.record if row and goes_on else None
            is_kept = name in newer or (known and _is_as_new(known, record))
            if row is None or not is_kept:
                row = self._listed(known, record, stamp, quiet=newest is None and self._detailed)
            self._tasks[name] = row
            self._answers.pop(name, None)
        self._keep_unlisted(before, newer, task_list.epoch)
        if newest is None and self._detailed and task_list.records:
            still_open = sum(not record.state.is_terminal for record in task_list.records)
            self.note(words.first_list(len(task_list.records), still_open))

    def _listed(
        self, before: TaskRecord | None, record: TaskRecord, stamp: float, *, quiet: bool
    ) -> TaskRow:
        """Return the row for a record of the list that tells something new."""
        name = record.task.id
        self._changes.tasks.add(name)
        if not quiet:
            known = before or self._answers.get(name)
            if known is None and name not in self._posted:
                self.note(words.task_listed(record.task))
            self._note_task(known, record)
        return TaskRow(record, stamp)

    def _keep_unlisted(self, unlisted: Mapping[str, TaskRow], newer: set[str], epoch: int) -> None:
        """Of the rows that are not on the list, keep the newer ones and the last refused ones."""
        refused = [name for name, row in unlisted.items() if row.is_refused]
        kept = newer.union(refused[-MAX_REMEMBERED:])
        for name, row in unlisted.items():
            if name in kept:
                self._tasks[name] = row
                continue
            self._changes.tasks.add(name)
            self.bid_book.forget(name)
            self._posted.pop(name, None)
            if not row.is_open:
                self._answer(row.record.told(epoch))
            elif self._detailed:
                self.note(words.task_removed(name))

    def _take_update(self, update: TaskUpdate, stamp: float) -> None:
        name, row = update.task_id, self._tasks.get(update.task_id)
        if update.state is TaskState.REJECTED:
            self._take_refusal(update, stamp)
            return
        is_stale = row is not None and not row.is_refused and _is_late(row, update, stamp)
        if is_stale or update.epoch < self.leadership.epoch:
            return
        task = self.posted(name)
        if task is None:
            self._answer_and_tell(update)
            return
        before = row.record if row else TaskRecord(task)
        waits = update.state is TaskState.WAITING
        told = (before.assignment, before.eta) == (update.assignment, update.eta)
        record = replace(
            before,
            state=update.state,
            robot="" if waits else update.robot_id or before.robot,
            step=update.step,
            eta=update.eta,
            predicted_at=before.predicted_at if told else stamp,  # the blackboard repeats it
            reason=update.reason,
            assignment=update.assignment,
        )
        if row is None or record != before:
            self._tasks[name] = TaskRow(record, stamp)
            self._changes.tasks.add(name)
            self._note_task(before if row else None, record)

    def _take_refusal(self, update: TaskUpdate, stamp: float) -> None:
        name = update.task_id
        self._answer_and_tell(update)
        task, row = self._posted.get(name), self._tasks.get(name)
        if task is None or (row and not row.is_refused):
            return  # a second task under a taken id: the first one stands as it is
        self._tasks[name] = TaskRow(
            TaskRecord(task, TaskState.REJECTED, reason=update.reason), stamp
        )
        self._changes.tasks.add(name)

    def _answer_and_tell(self, update: TaskUpdate) -> None:
        """Keep what was said of a task that is not on the list, and tell it once."""
        known = self._answers.get(update.task_id)
        told = (update.state, update.step, update.reason)
        if known is None or (known.state, known.step, known.reason) != told:
            self.note(words.update_event(update))
        self._answer(update)

    def _answer(self, update: TaskUpdate) -> None:
        self._answers.pop(update.task_id, None)
        self._answers[update.task_id] = update
        if len(self._answers) > MAX_ANSWERS:
            del self._answers[next(iter(self._answers))]

    def _note_task(self, before: TaskRecord | TaskUpdate | None, record: TaskRecord) -> None:
        bids = self.bid_book.bids(record.task.id) if self._detailed else None
        self.note(*words.task_change(before, record, bids))

    def _take_status(self, status: RobotStatus, now: float) -> None:
        name, before = status.robot_id, self._robots.get(status.robot_id)
        beat = self.heartbeat
        is_lost = beat is not None and name in beat.offline
        if status.state is not RobotState.OFFLINE:
            waits = self.traffic.words_of(name) if self.traffic else ""
            self._put_robot(name, RobotRow(status, now, is_lost=is_lost, waits=waits), now)
        elif before is None:
            self._put_robot(name, RobotRow(status, now, is_silent=True, is_lost=is_lost), now)
        elif before.is_silent:  # otherwise, what it says itself is newer
            self._put_robot(name, replace(before, status=status), now)

    def _put_robot(self, name: str, row: RobotRow, now: float) -> None:
        """Replace the row of a robot, and tell what that changes."""
        before = self._robots.get(name)
        self._robots[name] = row
        if before is None or replace(before, heard=row.heard) != row:
            self._changes.robots.add(name)
        if before is None or before.state is not row.state:
            reason = row.reason
            if row.is_silent and row.status.state is not RobotState.OFFLINE:
                reason = f"not heard here for {duration(now - row.heard)}"
            was = before.state if before else None
            self.note(words.robot_change(name, was, row.state, reason, row.status.charge))

    def _take_traffic(self, state: TrafficState, now: float) -> None:
        before = self.traffic
        if before is not None and state.epoch < before.epoch:
            return
        self.traffic, self._traffic_heard, self.planner_is_silent = state, now, False
        self._show_waits(state)
        self.note(*traffic_change(before, state))

    def _show_waits(self, state: TrafficState) -> None:
        for name, row in self._robots.items():
            waits = state.words_of(name)
            if waits != row.waits:
                self._robots[name] = replace(row, waits=waits)
                self._changes.robots.add(name)

    def _take_heartbeat(self, beat: Heartbeat, now: float) -> None:
        before = self.leadership.heartbeat
        if self.leadership.hear(beat, now):
            self.note(*words.leader_change(before, beat))
            self._note_standing(now)
            for name, row in list(self._robots.items()):
                if row.is_lost is not (name in beat.offline):
                    self._put_robot(name, replace(row, is_lost=name in beat.offline), now)

    def _note_standing(self, now: float) -> None:
        standing, beat = self.leadership.standing(now), self.leadership.heartbeat
        if standing is not self._standing and beat:
            before, self._standing = self._standing, standing
            self.note(*words.standing_change(before, standing, beat))

    def _take_posted(self, task: Task) -> None:
        is_new = task.id not in self._posted and task.id not in self._tasks
        self._posted.pop(task.id, None)
        self._posted[task.id] = task
        if len(self._posted) > MAX_REMEMBERED:
            del self._posted[next(iter(self._posted))]
        if is_new:
            self.note(words.task_posted(task))


def _is_as_new(known: TaskRecord, record: TaskRecord) -> bool:
    """Return whether a record of the list tells nothing that the robot has not told already."""
    if known == record or known.state is TaskState.REJECTED or not record.is_held:
        return known == record
    progress = (record.state, record.step)
    return known.assignment == record.assignment and (known.state, known.step) > progress


def _is_late(row: TaskRow, update: TaskUpdate, stamp: float) -> bool:
    """Return whether an update tells what was so before: robots overtake the blackboard."""
    known = row.record
    if row.stamp > stamp:
        return True
    if known.state.is_terminal or update.state.is_terminal:
        return known.state.is_terminal
    before = (known.assignment, known.state is TaskState.STARTED)
    return (update.assignment, update.state is not TaskState.ASSIGNED) < before


def _written_after(stamp: float, rows: Mapping[str, TaskRow]) -> set[str]:
    """Return the ids of the tasks with news since a list was written; the next list has them."""
    return {name for name, row in rows.items() if row.stamp > stamp and not row.is_refused}
