# SPDX-License-Identifier: BSD-3-Clause
"""Takes tasks in, auctions them among the robots and follows them to their end.

This is the report's Blackboard. It decides by messages alone and keeps nothing that it could not
learn again: the task list lives in `RaftNode`, robots say how they are, and an order that was lost
is given again when a robot's status shows that it has not heard it. So every member of the hive
hosts one; it decides while its `RaftNode` is active, and only listens otherwise. What it decides it
tells once `RaftNode` has committed it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.auction.auctioneer import Auctioneer
from blackboard.auction.candidate_selection import CandidateSelection
from blackboard.auction.central import Central
from blackboard.auction.decision_log import NoBook
from blackboard.auction.reallocation import Reallocation
from blackboard.auction.splitting import unfinished_parts, with_wholes
from blackboard.auction.transfers import Transfers
from blackboard.board.awarding import Awarding
from blackboard.board.orders import Orders
from blackboard.board.recovery import put_back
from blackboard.board.retention import Retention
from blackboard.board.watch import Watch
from blackboard.domain.record import TaskRecord, TaskUpdate
from blackboard.domain.talker import NEW_TASK, ROBOT_STATUS, TASK_CANCEL, TASK_COST, TASK_STATE
from blackboard.domain.task import MAX_ID_LENGTH, TaskEvent, TaskState, analyze_task, unused_goals
from blackboard.errors import TaskRefusedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from blackboard.auction.decision_log import DecisionBook
    from blackboard.consensus.node import RaftNode
    from blackboard.costing.bid_basis import Bids
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.settings import BlackboardSettings
    from blackboard.domain.talker import Talker, Timer
    from blackboard.domain.task import Task

_LOOKS_IN_TIME = 5
"""How often lost and late robots are looked for within the time after which a robot is lost."""

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
        book: Where it notes why each task went to whom; nowhere, where it is left out.
        ways_for: Gives what knows how far it is for a robot of a radius [m], for central
            decisions; `path_lengths` for all, where it is left out.
    """

    def __init__(
        self,
        talker: Talker,
        backup: RaftNode,
        path_lengths: PathLengths,
        settings: BlackboardSettings,
        book: DecisionBook | None = None,
        ways_for: Callable[[float], PathLengths] | None = None,
    ) -> None:
        self._talker = talker
        self._backup = backup
        self._path_lengths = path_lengths
        self._settings = settings
        self._orders = Orders(talker, backup, settings.order_timeout)
        self._watch = Watch(talker, backup, self._orders, settings)
        in_service = self._watch.in_service
        awarding = Awarding(
            backup, self._orders, in_service, self._commit, talker, book or NoBook()
        )
        self._transfers = Transfers(backup.get, self._orders.recall_unbegun)
        central = Central(backup.get, ways_for or (lambda _radius: path_lengths), talker.now)
        self._auctioneer = Auctioneer(
            talker,
            backup,
            in_service,
            settings.bid_timeout,
            Reallocation(
                self._orders.held,
                self._watch.last,
                settings.improve_by,
                settings.improve_threshold,
            ),
            self._transfers,
            settings.order_timeout,
            awarding.carry_out,
            CandidateSelection(
                settings.most_asked,
                settings.offers_each,
                settings.most_bids,
                self._watch.last,
            ),
            central if settings.decision == "centralized" else None,
        )
        self._retention = Retention(settings.keep_ended, settings.most_ended)
        self._done_twice: set[str] = set()
        self._timers: list[Timer] = []

    def start(self) -> None:
        """Begin to listen."""
        self._backup.serve(self)
        leader = self._backup.may_act
        self._talker.subscribe(NEW_TASK, self._take_in, when=leader)
        self._talker.subscribe(TASK_CANCEL, self._cancel, when=leader)
        self._talker.subscribe(TASK_COST, self._take_bids, when=leader)
        self._talker.subscribe(TASK_STATE, self._hear_update, when=leader)
        self._talker.subscribe(ROBOT_STATUS, self._hear_status)

    def became_leader(self) -> None:
        """Begin to decide, with the task list that the hive has committed."""
        self._orders.resume(self._backup.records.values())
        self._watch.begin()
        self._retention.begin()
        self._timers = [
            self._talker.every(self._settings.reassign / _LOOKS_IN_TIME, self._look_after_robots),
            self._talker.every(self._settings.retry_period, self._auctioneer.try_again),
            self._talker.every(self._settings.improve_period, self._auctioneer.improve),
        ]
        self._look_after_robots()
        self._auctioneer.try_again()

    def stepped_down(self) -> None:
        """Stop to decide; what was not committed yet is for the next active one to do again."""
        for timer in self._timers:
            timer.cancel()
        self._timers = []
        self._auctioneer.stop()

    def _take_in(self, task: Task) -> None:
        known = self._backup.get(task.id)
        if known is not None and known.task.asks_the_same_as(task):
            self._backup.tell()
            self._backup.commit((), lambda: self._tell(known))
            return
        if known is not None:
            self._reject(task, "the id is taken by another task; post it with another id")
            return
        try:
            analyze_task(task, self._path_lengths)
        except TaskRefusedError as error:
            self._reject(task, str(error))
            return
        self._commit(TaskRecord.new(task, self._backup.earlier, unused_goals(task)))
        self._auctioneer.open()

    def _reject(self, task: Task, reason: str) -> None:
        """Tell why a task does not enter the list; only what could be its id is repeated.

        Members are told as well, for a lone founder of another hive may have posted it.
        """
        self._talker.refuse(NEW_TASK, reason)
        task_id = task.id[:MAX_ID_LENGTH]
        epoch = self._backup.epoch
        update = TaskUpdate(task_id, TaskState.REJECTED, epoch=epoch, reason=reason)
        self._talker.publish(TASK_STATE, update)

    def _cancel(self, task_id: str) -> None:
        record = self._backup.get(task_id)
        if record is None:
            listed = f"there is no task {task_id[:MAX_ID_LENGTH]!r} on the list"
            self._talker.refuse(TASK_CANCEL, f"{listed}; it may have ended long ago")
            return
        if record.state.is_terminal:
            self._backup.commit((), lambda: self._tell(record))
            return
        self._end(record, *unfinished_parts(record, self._backup.records))

    def _end(self, *records: TaskRecord, reason: str = "cancelled by an operator") -> None:
        """Cancel what has not ended yet, and stop the robots that are at it."""
        ended = [record.after(TaskEvent.CANCEL, eta=0.0, reason=reason) for record in records]
        changed = [record for record in ended if record is not None]

        def stop() -> None:
            for record in records:
                self._orders.take_back(record)

        self._commit(*changed, then=stop)

    def _take_bids(self, bids: Bids) -> None:
        if self._is_known(TASK_COST, bids.robot_id):
            self._auctioneer.take_bids(bids)

    def _is_known(self, topic: str, robot_id: str) -> bool:
        """Return whether a robot has ever said how it is; refuse what it says otherwise."""
        known = self._watch.knows(robot_id)
        if not known:
            self._talker.refuse(topic, f"no robot {robot_id[:MAX_ID_LENGTH]!r} has been heard")
        return known

    def _hear_update(self, update: TaskUpdate) -> None:
        """Follow what a robot reports; what this blackboard says itself comes by here too."""
        record = self._backup.get(update.task_id)
        event = _EVENTS.get(update.state)
        if event is None or not update.robot_id:
            return
        if record is None or 1 <= update.assignment <= record.earlier:
            if self._watch.knows(update.robot_id):
                self._orders.disown(update.task_id, update.robot_id, update.assignment)
            return
        if not self._is_known(TASK_STATE, update.robot_id):
            return
        # The robot repeats it until a copy of the list shows that it is known.
        self._backup.tell()
        holds = (update.robot_id, update.assignment) == (record.robot, record.assignment)
        # A repeated DONE is no news: what the robot has bid since holds.
        is_news = record.state is not TaskState.DONE
        if is_news and event is not TaskEvent.START:
            self._auctioneer.list_changed(update.robot_id)
        if event is TaskEvent.FINISH and not holds and record.is_once_held(update.assignment):
            self._believe(record, update)
        elif holds and event is TaskEvent.RELEASE:
            self._put_back(record, update)
        elif holds and (event is not TaskEvent.START or record.gets_on(update)):
            changed = record.reported(event, update)
            if changed is not None:
                self._commit(changed, tell=False)

    def _believe(self, record: TaskRecord, update: TaskUpdate) -> None:
        """Take a task for done by a robot that it no longer belongs to, and count double work."""
        known = record.task.id in self._done_twice
        begun = record.state in {TaskState.STARTED, TaskState.DONE}
        doubled = begun and record.robot != update.robot_id
        changed = record.reported(TaskEvent.FINISH, update)
        if doubled and not known:
            self._done_twice.add(record.task.id)
            other = record.robot or "its parts"
            reason = (
                f"done by {update.robot_id} as well as by {other}; "
                f"tasks with doubled work so far: {len(self._done_twice)}"
            )
            changed = replace(changed or record, reason=reason)
        if changed is not None:
            self._commit(changed, then=lambda: self._orders.take_back(record))
        if not record.state.is_terminal:
            parts = unfinished_parts(record, self._backup.records)
            self._end(*parts, reason=f"{record.task.id} was done as a whole")

    def _put_back(self, record: TaskRecord, update: TaskUpdate) -> None:
        """Have a task that a robot handed back done by another, or give it up."""
        if late := self._watch.lateness(record):
            update = replace(update, reason=f"{update.reason} ({late})")
        most = self._settings.most_hand_backs
        released = put_back(record, update, most, tried=not self._transfers.has_recalled(record))
        if released is not None:
            self._commit(released)
            self._auctioneer.open()

    def _hear_status(self, status: RobotStatus) -> None:
        if status.hive not in {"", self._backup.hive}:
            return
        can_bid_better = self._watch.hear(status)
        if can_bid_better and self._backup.may_act():
            self._auctioneer.bids_better(status.robot_id)

    def _look_after_robots(self) -> None:
        if not self._backup.may_act():
            return
        released = self._watch.look()
        if released:
            self._commit(*released)
            self._auctioneer.try_again()
        log = self._backup.member.log
        self._backup.forget(self._retention.due(log, self._talker.now()))

    def _commit(
        self, *records: TaskRecord, then: Callable[[], None] | None = None, tell: bool = True
    ) -> None:
        """Have changes written down; then tell everyone, unless the robot has done so already.

        What follows from them for the tasks that they are parts of belongs to the same change.
        """
        changed = with_wholes(records, self._backup.records)
        for record in changed:
            if record.state is not TaskState.WAITING or record.parts:
                self._auctioneer.withdraw(record.task.id)
        self._forget(changed)

        def committed() -> None:
            # An order that was waiting for its commit has been given in the meantime.
            self._forget(changed)
            for record in changed:
                if tell or record not in records:
                    self._tell(record)
            if then is not None:
                then()

        if changed:
            self._backup.commit(changed, committed)

    def _forget(self, changed: Iterable[TaskRecord]) -> None:
        """Order nothing again that no robot has to have any more."""
        for record in changed:
            if not record.is_held:
                self._orders.forget(record.task.id)

    def _tell(self, record: TaskRecord) -> None:
        """Tell those who are no members; these have the list."""
        self._talker.publish(TASK_STATE, record.told(self._backup.epoch), to=())
