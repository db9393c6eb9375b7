# SPDX-License-Identifier: BSD-3-Clause
"""A market without a blackboard: whoever got a task auctions it among all robots.

This is the contract net (R. G. Smith, The Contract Net Protocol, IEEE Transactions on Computers
29(12), 1980): each robot is the manager of the tasks that were posted to it, and a contractor of
the others. Nobody else knows of a task until its manager calls for bids.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.auction.auction import Auction
from blackboard.costing.bidding import Bidder
from blackboard.costing.cost import COST_MODELS
from blackboard.domain.record import Broadcast
from blackboard.domain.talker import (
    NEW_TASK,
    ROBOT_STATUS,
    TASK_BROADCAST,
    TASK_COST,
    TASK_STATE,
)
from hive_lab.architectures.task_book import TaskBook
from hive_lab.architectures.worker import Worker

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence
    from random import Random

    from blackboard.costing.bid_basis import Bids
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.record import TaskUpdate
    from blackboard.domain.talker import Talker, Timer
    from blackboard.domain.task import Task
    from hive_lab.architectures.trial import Trial, TrialRobot

_AGAIN = 5.0  # what nobody could take is auctioned again after this time [s]
_LOOK = 1.0  # time between two looks for lost robots and lost orders [s]


class Contractor(Worker):
    """Bids whenever a manager calls, each time as if nothing else was on offer."""

    def __init__(
        self, robot: TrialRobot, talker: Talker, path_lengths: PathLengths, cost_model: str
    ) -> None:
        super().__init__(robot, talker, path_lengths, cost_model)
        model = COST_MODELS[cost_model]
        self._bidder = Bidder(self.name, self.body, self.battery, self.schedule, model)

    def start(self) -> None:
        """Begin to listen."""
        super().start()
        self.talker.subscribe(TASK_BROADCAST, self._bid)

    @property
    def listeners(self) -> Collection[str]:
        """The managers of the tasks on its list."""
        return {entry.order.hive for entry in self.schedule}

    def _bid(self, call: Broadcast) -> None:
        answer = self._bidder.answer(call, self.pose, "", at_work=self.at_work)
        self.talker.publish(TASK_COST, answer, (call.hive,))


class Manager:
    """Auctions the tasks that were posted to one robot, one after the other.

    Args:
        talker: Of the robot.
        name: Of the robot.
        number: Of the robot; calls for bids and the answers to them carry it as their epoch.
        robots: The names of all robots.
        path_lengths: Of the robot.
        bid_timeout: How long it waits for bids at most [s].

    Attributes:
        book: Its tasks.
    """

    def __init__(
        self,
        talker: Talker,
        name: str,
        number: int,
        robots: frozenset[str],
        path_lengths: PathLengths,
        bid_timeout: float,
    ) -> None:
        self._bid_timeout = bid_timeout
        self.book = TaskBook(talker, name, path_lengths)
        self._talker = talker
        self._name = name
        self._number = number
        self._robots = robots
        self._auction: Auction | None = None
        self._auctions = 0
        self._timer: Timer | None = None
        self._silent: frozenset[str] = frozenset()  # robots that have not answered of late
        self._not_before: dict[str, float] = {}  # tasks that nobody could take [s]

    def start(self) -> None:
        """Begin to listen."""
        subscribe = self._talker.subscribe
        subscribe(NEW_TASK, self._take_in)
        subscribe(TASK_COST, self._hear_bids)
        subscribe(ROBOT_STATUS, self.book.hear_status)
        subscribe(TASK_STATE, self._hear_update)
        self._talker.every(_LOOK, self._look)

    def _take_in(self, task: Task) -> None:
        if self.book.take_in(task):
            self._next()

    def _next(self) -> None:
        """Auction the most urgent task that waits, the oldest of these first."""
        now = self._talker.now()
        waiting = [
            record
            for record in self.book.waiting()
            if self._not_before.get(record.task.id, 0.0) <= now
        ]
        if self._auction is not None or not waiting:
            return
        record = max(waiting, key=lambda each: each.task.priority)
        self._auctions += 1
        auction = Auction(self._number, self._auctions)
        auction = auction.next_round([record], self._robots, self._robots)
        self._auction = auction.excuse(self._silent)
        offers = ((record.task, record.step),)
        call = Broadcast(self._number, self._auctions, offers, self._name)
        self._talker.publish(TASK_BROADCAST, call)
        self._timer = self._talker.after(self._bid_timeout, self._close)

    def _hear_bids(self, bids: Bids) -> None:
        self._silent -= {bids.robot_id}
        auction = self._auction
        if auction is None or (bids.epoch, bids.auction) != (auction.epoch, auction.number):
            return
        self._auction, _ = auction.hear(bids)
        if not self._auction.missing:
            self._close()

    def _close(self) -> None:
        auction = self._auction
        if auction is None:
            return
        if self._timer is not None:
            self._timer.cancel()
        self._auction = None
        self._silent |= auction.missing
        result = auction.result()
        for bid in result.awards:
            self.book.give(bid.task_id, bid.robot_id)
        for task_id, _ in result.impossible:
            self._not_before[task_id] = self._talker.now() + _AGAIN
        self._next()

    def _hear_update(self, update: TaskUpdate) -> None:
        if self.book.hear_update(update) is not None:
            self._next()

    def _look(self) -> None:
        self.book.repeat()
        self.book.release_lost()
        self._next()


class ContractNet:
    """A market in a trial; see `trial.Architecture`. The operator posts each task to any robot.

    Args:
        trial: The fleet.

    Attributes:
        managers: By the names of their robots.
    """

    def __init__(self, trial: Trial) -> None:
        self.managers: dict[str, Manager] = {}
        names = frozenset(trial.robots)
        for number, (name, robot) in enumerate(trial.robots.items(), start=1):
            talker = trial.boot(name)
            path_lengths = trial.path_lengths()(robot.characteristics.radius)
            timeout = trial.choices.bid_timeout
            manager = Manager(talker, name, number, names, path_lengths, timeout)
            self.managers[name] = manager
            Contractor(robot, talker, path_lengths, trial.choices.cost_model).start()
            manager.start()

    @property
    def coordinator(self) -> str:
        """The robot that manages most tasks that have not ended."""

        def unfinished(name: str) -> int:
            records = self.managers[name].book.records.values()
            return sum(not record.state.is_terminal for record in records)

        return max(self.managers, key=unfinished)

    def receivers(self, random: Random) -> Sequence[str]:
        """Return all robots, in random order."""
        names = list(self.managers)
        return random.sample(names, len(names))
