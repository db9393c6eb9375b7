# SPDX-License-Identifier: BSD-3-Clause
"""Takes tasks in, auctions them among the robots and follows them to their end.

This is the report's Blackboard. It decides by messages alone and keeps nothing that it could not
learn again: the task list lives in `Backup`, robots say how they are, and an order that was lost
is given again when a robot's status shows that it has not heard it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.auction import Auction
from blackboard.characteristics import RobotState
from blackboard.errors import BidRefusedError, TaskRefusedError
from blackboard.orders import Orders
from blackboard.presence import Presence
from blackboard.record import Broadcast, TaskRecord, TaskUpdate
from blackboard.talker import (
    NEW_TASK,
    ROBOT_STATUS,
    TASK_BROADCAST,
    TASK_CANCEL,
    TASK_COST,
    TASK_STATE,
)
from blackboard.task import (
    MAX_ID_LENGTH,
    TaskEvent,
    TaskState,
    analyze_task,
    step_to_resume,
    unused_goals,
)

if TYPE_CHECKING:
    from blackboard.backup import Backup
    from blackboard.characteristics import RobotStatus
    from blackboard.cost import Bid, Bids
    from blackboard.settings import BlackboardSettings
    from blackboard.talker import Talker, Timer
    from blackboard.task import Task
    from blackboard.ways import Ways

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
        talker: How it hears and speaks.
        backup: Keeps the task list.
        ways: Knows where a robot can stand.
        settings: How patient it is.
    """

    def __init__(
        self, talker: Talker, backup: Backup, ways: Ways, settings: BlackboardSettings
    ) -> None:
        self._talker = talker
        self._backup = backup
        self._ways = ways
        self._settings = settings
        self._presence = Presence(settings.robot_timeout)
        self._orders = Orders(talker, backup, settings.order_timeout)
        self._auction: Auction | None = None
        self._closing: Timer | None = None
        self._auctions = 0
        self._slow: set[str] = set()
        self._parked: set[str] = set()
        self._changed = False

    def start(self) -> None:
        """Begin to listen."""
        self._talker.subscribe(NEW_TASK, self._take_in)
        self._talker.subscribe(TASK_CANCEL, self._cancel)
        self._talker.subscribe(TASK_COST, self._take_bids)
        self._talker.subscribe(TASK_STATE, self._hear_update)
        self._talker.subscribe(ROBOT_STATUS, self._hear_status)
        self._talker.every(self._settings.robot_timeout / 5, self._look_for_silence)
        self._talker.every(self._settings.retry_period, self._try_again)

    def _take_in(self, task: Task) -> None:
        known = self._backup.get(task.id)
        if known is not None and known.task.asks_the_same_as(task):
            self._tell(known)
            return
        if known is not None:
            self._reject(task, "the id is taken by another task; post it with another id")
            return
        try:
            analyze_task(task, self._ways)
        except TaskRefusedError as error:
            self._reject(task, str(error))
            return
        self._commit(TaskRecord(task, reason=unused_goals(task)))
        self._open_auction()

    def _reject(self, task: Task, reason: str) -> None:
        """Tell why a task does not enter the list; only what could be its id is repeated."""
        task_id = task.id[:MAX_ID_LENGTH]
        epoch = self._backup.epoch
        update = TaskUpdate(task_id, TaskState.REJECTED, epoch=epoch, reason=reason)
        self._talker.publish(TASK_STATE, update)

    def _cancel(self, task_id: str) -> None:
        record = self._backup.get(task_id)
        if record is None:
            self._talker.warn(f"cannot cancel {task_id[:MAX_ID_LENGTH]!r}: no such task")
            return
        cancelled = record.after(TaskEvent.CANCEL, eta=0.0, reason="cancelled by an operator")
        if cancelled is None:
            self._tell(record)
            return
        self._commit(cancelled)
        self._orders.take_back(record)

    def _open_auction(self) -> None:
        """Ask for bids on all that waits, unless an auction is under way."""
        waiting = [
            record
            for record in self._backup.records
            if record.state is TaskState.WAITING and record.task.id not in self._parked
        ]
        if self._auction is not None or not waiting:
            return
        robots = self._presence.in_service()
        if not robots:
            for record in waiting:
                self._park(record, "no robot is in service")
            return
        self._auctions += 1
        self._changed = False
        epoch = self._backup.epoch
        self._auction = Auction(epoch, self._auctions, waiting, robots - self._slow or robots)
        offers = tuple((record.task, record.step) for record in waiting)
        self._closing = self._talker.after(self._settings.bid_timeout, self._close_auction)
        self._talker.publish(TASK_BROADCAST, Broadcast(epoch, self._auctions, offers))

    def _take_bids(self, bids: Bids) -> None:
        self._slow.discard(bids.robot_id)
        if self._auction is None:
            return
        try:
            self._auction.take(bids)
        except BidRefusedError as error:
            self._talker.warn(f"bids refused: {error}")
            return
        if not self._auction.missing:
            self._close_auction()

    def _close_auction(self) -> None:
        auction = self._auction
        if auction is None:
            return
        if self._closing is not None:
            self._closing.cancel()
        self._auction = None
        self._slow |= auction.missing
        result = auction.result()
        for bid in result.awards:
            self._assign(bid)
        for task_id, reason in result.impossible:
            record = self._backup.get(task_id)
            if record is not None:
                self._park(record, reason)
        if self._changed:
            self._parked.clear()
        self._talker.after(0.0, self._open_auction)

    def _assign(self, bid: Bid) -> None:
        record = self._backup.get(bid.task_id)
        if record is None:
            return
        assigned = record.after(
            TaskEvent.ASSIGN,
            robot=bid.robot_id,
            assignment=record.assignment + 1,
            eta=bid.eta,
            reason=unused_goals(record.task),
        )
        if assigned is not None:
            self._commit(assigned)
            self._orders.give(assigned)

    def _hear_update(self, update: TaskUpdate) -> None:
        """Follow what a robot reports; what this blackboard says itself comes by here too."""
        record = self._backup.get(update.task_id)
        event = _EVENTS.get(update.state)
        if record is None or event is None or not update.robot_id:
            return
        if event is not TaskEvent.START:
            # The robot repeats it until a copy of the list shows that it is known.
            self._backup.tell()
        holds = (update.robot_id, update.assignment) == (record.robot, record.assignment)
        if not holds and event is not TaskEvent.FINISH:
            return
        if event is TaskEvent.START and update.step < record.step:
            return
        update = replace(update, step=min(update.step, record.steps))
        if event is TaskEvent.RELEASE:
            self._put_back(record, update)
            return
        changed = record.after(
            event, robot=update.robot_id, step=update.step, eta=update.eta, reason=update.reason
        )
        if changed is not None:
            self._commit(changed, tell=False)
            if not holds:
                self._orders.take_back(record)

    def _put_back(self, record: TaskRecord, update: TaskUpdate) -> None:
        """Have a task that a robot handed back done by another, or give it up."""
        tried = (*record.tried, update.robot_id)
        changes = {"tried": tried, "eta": 0.0, "reason": update.reason}
        if len(tried) >= self._settings.most_hand_backs:
            changes["reason"] = f"given up after {len(tried)} tries, the last: {update.reason}"
            put_back = record.after(TaskEvent.FAIL, **changes)
        else:
            step = step_to_resume(record.task, update.step)
            put_back = record.after(TaskEvent.RELEASE, robot="", step=step, **changes)
        if put_back is not None:
            self._commit(put_back)
            self._open_auction()

    def _hear_status(self, status: RobotStatus) -> None:
        if status.state is RobotState.OFFLINE:
            return
        if self._presence.hear(status, self._talker.now()):
            self._try_again()
        self._orders.compare(status)

    def _look_for_silence(self) -> None:
        for status in self._presence.fall_silent(self._talker.now()):
            self._talker.publish(ROBOT_STATUS, status)
            for record in self._orders.given_to(status.robot_id):
                self._commit(replace(record, reason=f"{record.robot} is {status.reason}"))

    def _try_again(self) -> None:
        """Auction again what nobody could take: something has changed.

        What the auction under way is going to find impossible may be out of date as well.
        """
        self._parked.clear()
        self._changed = True
        self._open_auction()

    def _park(self, record: TaskRecord, reason: str) -> None:
        """Leave a task waiting, with the reason, until something changes."""
        self._parked.add(record.task.id)
        if record.state is TaskState.WAITING and record.reason != reason:
            self._commit(replace(record, reason=reason))

    def _commit(self, record: TaskRecord, *, tell: bool = True) -> None:
        """Write a change down and tell everyone, unless the robot has done so already."""
        if record.state not in {TaskState.ASSIGNED, TaskState.STARTED}:
            self._orders.forget(record.task.id)
        if self._auction is not None and record.state is not TaskState.WAITING:
            self._auction.withdraw(record.task.id)
        self._backup.commit(record)
        if tell:
            self._tell(record)

    def _tell(self, record: TaskRecord) -> None:
        update = TaskUpdate(
            task_id=record.task.id,
            state=record.state,
            robot_id=record.robot,
            step=record.step,
            steps=record.steps,
            eta=record.eta,
            epoch=self._backup.epoch,
            reason=record.reason,
            assignment=record.assignment,
        )
        self._talker.publish(TASK_STATE, update)
