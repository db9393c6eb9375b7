# SPDX-License-Identifier: BSD-3-Clause
"""Takes tasks in, auctions them among the robots and follows them to their end.

This is the report's Blackboard. It decides by messages alone and keeps nothing that it could not
learn again: the task list lives in `RaftNode`, robots tell their status, and a lost order is
repeated when a robot's status shows that it was not heard. So every member of the hive hosts a
blackboard; it decides while its `RaftNode` leads, and only listens otherwise. It tells a decision
once `RaftNode` has committed it.
"""

from __future__ import annotations

import traceback
from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.auction.auctioneer import Auctioneer
from blackboard.auction.central import Central
from blackboard.auction.splitting import part_ids, unfinished_parts, with_wholes
from blackboard.auction.step import (
    ImprovementDue,
    RobotImproved,
    ScheduleChanged,
    Signal,
    Withdrawn,
)
from blackboard.board.awarding import assigned, decisions, unassigned
from blackboard.board.orders import Orders
from blackboard.board.recovery import put_back
from blackboard.board.retention import Retention
from blackboard.board.unsplitting import Unsplitting
from blackboard.board.watch import Presence, Watch
from blackboard.consensus.journal import to_json
from blackboard.domain.record import MOVES_ON, OrderKind, TaskRecord, TaskUpdate
from blackboard.domain.talker import NEW_TASK, ROBOT_STATUS, TASK_CANCEL, TASK_COST, TASK_STATE
from blackboard.domain.task import MAX_ID_LENGTH, TaskEvent, TaskState, analyze_task, unused_goals
from blackboard.errors import JournalError, TaskRefusedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from blackboard.auction.auction import Result
    from blackboard.auction.decision import Decision
    from blackboard.auction.search.searcher import Searcher
    from blackboard.consensus.node import RaftNode
    from blackboard.costing.bid_basis import Bids
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.settings import BlackboardSettings
    from blackboard.domain.talker import Talker, Timer
    from blackboard.domain.task import Task

_LOOKS_IN_TIME = 5
"""Looks for lost and overdue robots within the time after which a robot counts as lost."""

_EVENTS = {
    TaskState.WAITING: TaskEvent.RELEASE,
    TaskState.STARTED: TaskEvent.START,
    TaskState.DONE: TaskEvent.FINISH,
    TaskState.FAILED: TaskEvent.FAIL,
}
"""What a robot's report of a state means; robots report no other."""


class Blackboard:
    """Decides which robot does which task.

    Args:
        note: Keeps the decisions, which tell why each task went to whom.
        path_lengths_for: Gives the path lengths for a robot of a radius [m], for central
            decisions; `path_lengths` for all if None.
        searcher: Searches for plans, with `decision: planned`.
    """

    def __init__(
        self,
        talker: Talker,
        node: RaftNode,
        path_lengths: PathLengths,
        settings: BlackboardSettings,
        *,
        note: Callable[[Iterable[Decision]], None] = lambda _decisions: None,
        path_lengths_for: Callable[[float], PathLengths] | None = None,
        searcher: Searcher | None = None,
    ) -> None:
        self._talker = talker
        self._node = node
        self._path_lengths = path_lengths
        self._settings = settings
        self._presence = Presence(settings.reassign)
        self._orders = Orders(talker, node, settings.order_timeout)
        self._watch = Watch(talker, node, self._orders, self._presence, settings)
        self._unsplitting = Unsplitting(
            talker, node, self._orders, self._presence, settings.reassign
        )
        self._note = note
        central = Central(
            node.get,
            path_lengths_for or (lambda _radius: path_lengths),
            talker.date,
            settings.most_bids,
        )
        self._auctioneer = Auctioneer(
            talker,
            node,
            settings,
            in_service=self._presence.in_service,
            known=self._presence.known,
            last=self._presence.last,
            offered=self._unsplitting.offered,
            recall=self._recall,
            reorder=self._orders.give,
            carry_out=self._carry_out,
            central=None if settings.decision == "distributed" else central,
            searcher=searcher,
        )
        self._retention = Retention(settings.keep_ended, settings.most_ended)
        self._done_twice: set[str] = set()
        self._timers: list[Timer] = []

    def start(self) -> None:
        """Begin to listen."""
        self._node.serve(self)
        leads = self._node.may_act
        self._talker.subscribe(NEW_TASK, self._take_in, when=leads)
        self._talker.subscribe(TASK_CANCEL, self._cancel, when=leads)
        self._talker.subscribe(TASK_COST, self._hear_bids, when=leads)
        self._talker.subscribe(TASK_STATE, self._hear_update, when=leads)
        self._talker.subscribe(ROBOT_STATUS, self._hear_status)

    def became_leader(self) -> None:
        """Begin to decide, with the task list that the hive has committed."""
        self._orders.resume(self._node.records.values())
        self._watch.begin()
        self._unsplitting.begin()
        self._retention.begin()
        self._auctioneer.lead()
        every, settings = self._talker.every, self._settings
        self._timers = [
            every(settings.reassign / _LOOKS_IN_TIME, self._look),
            every(settings.retry_period, self._retry),
            every(settings.improve_period, self._improve),
        ]
        self._look()
        self._retry()

    def stepped_down(self) -> None:
        """Stop deciding; what is not committed yet is left to the next leader."""
        for timer in self._timers:
            timer.cancel()
        self._timers = []
        self._auctioneer.retire()

    def _recall(self, record: TaskRecord) -> None:
        """Ask a robot to hand a task back; one that has begun since keeps it."""
        begun = record.state is TaskState.STARTED
        self._orders.send(record, OrderKind.HAND_BACK if begun else OrderKind.HAND_BACK_UNBEGUN)

    def _retry(self) -> None:
        self._auctioneer.handle(Signal.FLEET_CHANGED)

    def _improve(self) -> None:
        self._auctioneer.handle(ImprovementDue(tuple(self._orders.held())))

    def _look(self) -> None:
        """Release the tasks of lost robots, and forget what ended long ago."""
        if not self._node.may_act():
            return
        released = self._watch.look()
        if released:
            self._commit(*released)
            self._retry()
        self._undo_splits()
        self._node.forget(self._retention.due(self._node.member.log, self._talker.now()))

    def _undo_splits(self) -> None:
        """Go on to undo splits of which no part has been begun."""
        anew, more = self._unsplitting.look()
        if anew:
            self._auctioneer.handle(Withdrawn(anew))
        if more:
            self._auctioneer.handle(Signal.TASK_CAME)

    def _carry_out(self, result: Result, then: Callable[[], None]) -> None:
        """Assign tasks to their winners and split tasks that are too heavy, as one change."""
        won = list(assigned(result, self._node, self._talker.date(), self._unsplitting.is_ready))
        known = [self._node.get(record.task.id) for record in won]
        joined = [part for whole in known if whole for part in part_ids(whole)]
        others = unassigned(result, self._node, self._presence)
        self._unsplitting.stop(task_id for task_id, _ in result.impossible)
        self._unsplitting.stop(record.task.id for record in won)

        def order() -> None:
            for record in won:
                self._orders.give(record, result.places.get(record.task.id, 0))
            then()

        if won or others:
            self._commit(*won, *others, then=order, joined=joined)
        else:
            then()
        # While the other members write the change to disk.
        try:
            self._note(decisions(result, won, others, self._talker.date()))
        except JournalError as error:
            self._talker.warn(f"the reasons for these assignments are lost: {error}")

    def _take_in(self, task: Task) -> None:
        known = self._node.get(task.id)
        if known is not None and known.task.asks_the_same_as(task):
            self._node.tell()
            self._node.commit((), lambda: self._tell(known))
            return
        if known is not None:
            self._reject(task, "the id is taken by another task; post it with another id")
            return
        try:
            record = self._worked_through(task)
        except TaskRefusedError as error:
            self._reject(task, str(error))
            return
        except Exception as error:  # noqa: BLE001  (whatever it is, it must not reach the other members)
            self._talker.warn(f"a task that was posted: {task!r:.1000}\n{traceback.format_exc()}")
            self._reject(
                task,
                f"the hive cannot work this task out: {type(error).__name__}: {error}; this is a "
                "defect of the hive, please report it with the task and the leader's log",
            )
            return
        self._node.hold(record, lambda: self._tell(record))
        self._auctioneer.handle(Signal.TASK_CAME)

    def _worked_through(self, task: Task) -> TaskRecord:
        """Return the record of a posted task, after every first step with it was tried.

        What cannot be carried out must not be replicated: each leader would fail at it in turn.
        """
        analyze_task(task, self._path_lengths)
        now = self._talker.date()
        # A stamp ahead is by another clock: the sender's is wrong, or was not known yet.
        if not 0 < task.posted <= now:
            task = replace(task, posted=now)
        record = TaskRecord.new(task, self._node.earlier, unused_goals(task))
        to_json(record)
        self._auctioneer.rehearse(record)
        return record

    def _reject(self, task: Task, reason: str) -> None:
        """Tell why a task does not enter the list; only what could be its id is repeated.

        Members are told as well, because a lone member that bootstraps another hive may have
        posted it.
        """
        self._talker.refuse(NEW_TASK, reason)
        task_id, epoch = task.id[:MAX_ID_LENGTH], self._node.epoch
        update = TaskUpdate(task_id, TaskState.REJECTED, epoch=epoch, reason=reason)
        self._talker.publish(TASK_STATE, update)

    def _cancel(self, task_id: str) -> None:
        record = self._node.get(task_id)
        if record is None:
            listed = f"there is no task {task_id[:MAX_ID_LENGTH]!r} on the list"
            self._talker.refuse(TASK_CANCEL, f"{listed}; it may have ended long ago")
        elif record.state.is_terminal:
            self._node.commit((), lambda: self._tell(record))
        else:
            self._end(record, *unfinished_parts(record, self._node.records))

    def _end(self, *records: TaskRecord, reason: str = "cancelled by an operator") -> None:
        """Cancel tasks that have not ended yet, and stop the robots that do them."""
        ended = [record.after(TaskEvent.CANCEL, eta=0.0, reason=reason) for record in records]

        def stop() -> None:
            for record in records:
                self._orders.send(record, OrderKind.TAKE_BACK)

        self._commit(*(record for record in ended if record is not None), then=stop)

    def _hear_bids(self, bids: Bids) -> None:
        if self._is_known(TASK_COST, bids.robot_id):
            self._auctioneer.hear_bids(bids)

    def _is_known(self, topic: str, robot_id: str) -> bool:
        """Return whether a robot has ever told its status; if not, refuse what it says."""
        known = self._presence.knows(robot_id)
        if not known:
            self._talker.refuse(topic, f"no robot {robot_id[:MAX_ID_LENGTH]!r} has been heard")
        return known

    def _hear_status(self, status: RobotStatus) -> None:
        if status.hive not in {"", self._node.hive}:
            return
        can_bid_better = self._watch.hear(status)
        if can_bid_better and self._node.may_act():
            # First, so that the robot begins no part of what it can carry as a whole.
            self._undo_splits()
            self._auctioneer.handle(RobotImproved(status.robot_id))

    def _hear_update(self, update: TaskUpdate) -> None:
        """Follow what a robot reports; this blackboard's own updates arrive here too."""
        robot_id = update.robot_id
        record = self._node.get(update.task_id)
        event = _EVENTS.get(update.state)
        if event is None or not robot_id:
            return
        if record is None or 1 <= update.assignment <= record.earlier:
            if self._presence.knows(robot_id):
                self._orders.disown(update.task_id, robot_id, update.assignment)
            return
        if not self._is_known(TASK_STATE, robot_id):
            return
        # The robot repeats its report until a copy of the list shows that it was heard.
        self._node.tell()
        holds = (robot_id, update.assignment) == (record.robot, record.assignment)
        # A repeated DONE is no news: what the robot has bid since holds.
        if event is not TaskEvent.START and record.state is not TaskState.DONE:
            self._auctioneer.handle(ScheduleChanged(robot_id))
        if event is TaskEvent.FINISH and not holds and record.is_once_held(update.assignment):
            self._believe(record, update)
        elif holds and event is TaskEvent.RELEASE:
            self._release(record, update)
        elif holds and (event is not TaskEvent.START or record.gets_on(update)):
            changed = record.reported(event, update, self._talker.date())
            if changed is not None:
                self._commit(changed, tell=False)

    def _believe(self, record: TaskRecord, update: TaskUpdate) -> None:
        """Accept that a robot has done a task it no longer holds, and count doubled work."""
        task_id = record.task.id
        begun = record.state in {TaskState.STARTED, TaskState.DONE}
        changed = record.reported(TaskEvent.FINISH, update, self._talker.date())
        if begun and record.robot != update.robot_id and task_id not in self._done_twice:
            self._done_twice.add(task_id)
            reason = (
                f"done by {update.robot_id} as well as by {record.robot or 'its parts'}; "
                f"tasks with doubled work so far: {len(self._done_twice)}"
            )
            changed = replace(changed or record, reason=reason)
        if changed is not None:
            self._commit(changed, then=lambda: self._orders.send(record, OrderKind.TAKE_BACK))
        if not record.state.is_terminal:
            parts = unfinished_parts(record, self._node.records)
            self._end(*parts, reason=f"{task_id} was done as a whole")

    def _release(self, record: TaskRecord, update: TaskUpdate) -> None:
        """Offer a task that a robot handed back to the others, or give it up."""
        if late := self._watch.lateness(record):
            update = replace(update, reason=f"{update.reason} ({late})")
        self._unsplitting.note_release(record, update)
        is_moved = self._auctioneer.has_recalled(record)
        if is_moved:
            reason = f"{update.robot_id} has handed it back: {MOVES_ON}"
            update = replace(update, reason=reason)
        recalled = is_moved or self._unsplitting.has_recalled(record)
        released = put_back(record, update, self._settings.most_hand_backs, tried=not recalled)
        if released is not None:
            self._commit(released)
            self._auctioneer.handle(Signal.TASK_CAME)

    def _commit(
        self,
        *records: TaskRecord,
        then: Callable[[], None] | None = None,
        tell: bool = True,
        joined: Iterable[str] = (),
    ) -> None:
        """Have changes committed; then tell everyone, unless the robot has done so already.

        What follows for the tasks that they are parts of belongs to the same change. The parts
        that are `joined` leave the list.
        """
        now, forgotten = self._talker.date(), tuple(joined)
        records = tuple(each.dated(now) for each in records)
        changed = tuple(each.dated(now) for each in with_wholes(records, self._node.records))
        if not changed:
            return
        gone = [record for record in map(self._node.get, forgotten) if record]
        self._auctioneer.handle(
            Withdrawn(
                frozenset(
                    record.task.id
                    for record in changed
                    if record.state is not TaskState.WAITING or record.parts
                ).union(forgotten)
            )
        )
        self._stop_resending(changed)

        def committed() -> None:
            # An order that was waiting for its commit has been given in the meantime.
            self._stop_resending(changed)
            for record in changed:
                if tell or record not in records:
                    self._tell(record)
            for part in gone:
                reason = f"robots do {part.parent} as a whole again"
                self._tell(replace(part, state=TaskState.CANCELLED, reason=reason))
            if then is not None:
                then()

        self._node.commit(changed, committed, forgotten)

    def _stop_resending(self, changed: Iterable[TaskRecord]) -> None:
        """Stop resending orders for tasks that no robot holds."""
        for record in changed:
            if not record.is_held:
                self._orders.forget(record.task.id)

    def _tell(self, record: TaskRecord) -> None:
        """Tell everyone who is no member; members have the list."""
        self._talker.publish(TASK_STATE, record.told(self._node.epoch), to=())
