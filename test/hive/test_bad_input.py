# SPDX-License-Identifier: BSD-3-Clause
"""A working hive survives thousands of malformed messages on every topic."""

import math
import random

import numpy as np
import pytest

from blackboard.board.intake import why_refused
from blackboard.consensus.log import Entry, Position
from blackboard.consensus.messages import AppendEntries, AppendReply, Ballot, BallotKind, Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.costing.bid_basis import Bids
from blackboard.costing.grid_path_lengths import GridPathLengths
from blackboard.domain.bid import Bid
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import Broadcast, Order, OrderKind, TaskRecord, TaskUpdate
from blackboard.domain.talker import (
    BACKUP,
    BB_ACK,
    BB_ENTRIES,
    BB_VOTE,
    NEW_TASK,
    ROBOT_STATUS,
    SET_STATE,
    SYNC,
    TASK_ASSIGN,
    TASK_BROADCAST,
    TASK_CANCEL,
    TASK_COST,
    TASK_STATE,
)
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.domain.validation import MAX_NAME
from hive_common.grid_map import GridMap
from hive_common.pose import Pose
from hive_lab.virtual.hive import Hive

MESSAGES = 5000
HUGE = "x" * 10_000_000
NUMBERS = (math.nan, math.inf, -math.inf, -1.0, 0.0, 1e308, 5e-324)
TEXTS = ("", "nobody", "\x00", "\ufffd\ufffd", "a b", "../..", HUGE)
COUNTS = (0, 1, 2, 255, 65_535, 2**32 - 1)


class Nonsense:
    """Builds messages of every topic from odd values; `seed` draws them."""

    def __init__(self, seed):
        self.draw = random.Random(seed)
        self.kinds = {
            NEW_TASK: self.task,
            TASK_CANCEL: self.text,
            TASK_BROADCAST: lambda: Broadcast(self.count(), self.count(), self.offers()),
            TASK_COST: self.bids,
            TASK_ASSIGN: self.order,
            TASK_STATE: self.update,
            ROBOT_STATUS: self.status,
            SYNC: lambda: TaskList(0, self.count(), (self.record(),)),
            BACKUP: lambda: Heartbeat(
                2**32 - 1, self.text(), self.text(), (self.text(),), sent=self.number()
            ),
            BB_ENTRIES: self.entries,
            BB_ACK: lambda: AppendReply(self.text(), 2**32 - 1, self.count(), self.number()),
            BB_VOTE: self.ballot,
            f"robot1/{SET_STATE}": self.text,
        }

    def message(self):
        topic = self.draw.choice(sorted(self.kinds))
        return topic, self.kinds[topic]()

    def number(self):
        return self.draw.choice(NUMBERS)

    def text(self):
        return self.draw.choice(TEXTS)

    def count(self):
        return self.draw.choice(COUNTS)

    def pose(self):
        return Pose(self.number(), self.number(), self.number())

    def task(self):
        kind, priority = self.draw.choice((0, 1, 7, 255)), self.draw.randint(11, 255)
        goals = tuple(self.pose() for _ in range(self.draw.randint(0, 3)))
        return Task(self.text(), kind, goals, priority, self.number(), self.text(), self.number())

    def offers(self):
        return tuple((self.task(), self.count()) for _ in range(self.draw.randint(0, 2)))

    def bids(self):
        robot = self.draw.choice((*TEXTS, "robot1"))
        bid = Bid(robot, self.text(), self.number(), self.number(), self.number(), self.text())
        return Bids(robot, self.count(), self.count(), (bid,))

    def order(self):
        robot = self.draw.choice((*TEXTS, "robot1"))
        return Order(
            self.task(),
            robot,
            self.draw.choice(tuple(OrderKind)),
            step=self.count(),
            epoch=self.count(),
            assignment=self.count(),
            heard=self.number(),
        )

    def update(self):
        task_id = self.draw.choice((*TEXTS, "real"))
        state = self.draw.choice(tuple(TaskState))
        return TaskUpdate(
            task_id, state, self.text(), self.count(), self.count(), self.number(), self.count()
        )

    def status(self):
        return RobotStatus(
            self.text(),
            self.draw.choice(tuple(RobotState)),
            self.pose(),
            self.number(),
            self.number(),
            self.text(),
            self.text(),
            (self.text(),),
            self.number(),
        )

    def record(self):
        return TaskRecord(self.task(), self.draw.choice(tuple(TaskState)), self.text())

    def entries(self):
        entry = Entry(2**32 - 1, 1, (self.record(),))
        return AppendEntries(2**32 - 1, self.text(), Position(0, 0), (entry,), 1, self.number())

    def ballot(self):
        kind = self.draw.choice(tuple(BallotKind))
        where = Position(self.count(), self.count())
        return Ballot(kind, 2**32 - 1, self.text(), self.text(), where, granted=True)


@pytest.fixture
def hive():
    """A hive with one robot on its way to a task called `real`."""
    hive = Hive()
    hive.add_robot("robot1", Pose(0.0, 0.0, 0.0))
    hive.post(Task("real", TaskType.GAB, (Pose(1.0, 0.0, 0.0), Pose(2.0, 0.0, 0.0))))
    hive.network.run(1.0)
    return hive


@pytest.mark.parametrize("seed", range(3))
def test_nonsense_on_every_topic_changes_nothing_and_stops_nobody(hive, seed):
    nonsense = Nonsense(seed)
    for _ in range(MESSAGES):
        hive.network.send(*nonsense.message())
        hive.network.run(0.002)
    hive.network.run(60.0)
    hive.post(Task("after", TaskType.GA, (Pose(3.0, 0.0, 0.0),)))
    hive.network.run(60.0)

    assert hive.record("real").state is TaskState.DONE
    assert hive.record("real").robot == "robot1"
    assert hive.record("after").state is TaskState.DONE
    book = hive.talkers["blackboard"].refusals
    assert book.total > MESSAGES / 3
    assert len(hive.talkers["blackboard"].warnings) < book.total / 10


def test_a_hive_handles_a_burst_of_a_thousand_messages(hive):
    for number in range(1000):
        hive.network.send(
            NEW_TASK, Task(f"burst{number % 5}", TaskType.GA, (Pose(4.0, 0.0, 0.0),))
        )
    hive.network.run(600.0)

    assert {hive.record(f"burst{n}").state for n in range(5)} == {TaskState.DONE}


def test_an_unknown_robot_wins_no_auction(hive):
    hive.network.listen(
        TASK_BROADCAST,
        lambda said: hive.network.send(
            TASK_COST,
            Bids(
                "ghost",
                said.epoch,
                said.auction,
                tuple(Bid("ghost", task.id, 0.0, 0.0, 0.0) for task, _ in said.tasks),
            ),
        ),
    )
    hive.post(Task("next", TaskType.GA, (Pose(5.0, 0.0, 0.0),)))
    hive.network.run(120.0)

    assert hive.record("next").robot == "robot1"
    counts = hive.talkers["blackboard"].refusals.counts
    assert counts[TASK_COST, "no robot 'ghost' has been heard"] >= 1


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_is_rejected_by_name(number):
    status = RobotStatus("robot1", RobotState.IDLE, Pose(number, 0.0, 0.0), 1.0)

    assert why_refused(ROBOT_STATUS, status) == (
        f"RobotStatus.pose ({number:g}, 0, 0) is not made of finite numbers"
    )


@pytest.mark.parametrize("number", [1e308, -1e308, 3.5e38, 1e13])
def test_a_number_with_which_one_cannot_calculate_is_rejected_by_name(number):
    far = RobotStatus("robot1", RobotState.IDLE, Pose(0.0, number, 0.0), 1.0)
    heavy = RobotStatus("robot1", RobotState.IDLE, Pose(0.0, 0.0, 0.0), 1.0, payload=number)

    assert "is farther from the origin than 100 km" in why_refused(ROBOT_STATUS, far)
    assert f"RobotStatus.payload is {number}; allowed: " in why_refused(ROBOT_STATUS, heavy)


ABSURD = (*NUMBERS, 3.5e38, -1e308, 1e13, 1e5, -0.0)
"""Finite numbers that overflow in the arithmetic of cells or of messages, and the others."""


@pytest.mark.parametrize("number", ABSURD)
@pytest.mark.parametrize("field", ["x", "y", "yaw", "payload", "posted"])
def test_a_task_with_one_absurd_number_ends_no_member_and_the_next_task_is_done(number, field):
    hall = GridMap.of_blocked(np.zeros((60, 100), dtype=bool), 0.1)
    hive = Hive(path_lengths=GridPathLengths(hall))
    hive.add_robot("robot1", Pose(1.0, 1.0, 0.0), path_lengths=GridPathLengths(hall, 0.3))
    hive.network.run(1.0)
    numbers = {"x": 2.0, "y": 2.0, "yaw": 0.0, "payload": 0.0, "posted": 0.0} | {field: number}
    goal = Pose(numbers["x"], numbers["y"], numbers["yaw"])
    hive.network.send(
        NEW_TASK,
        Task("odd", 0, (goal,), payload=numbers["payload"], posted=numbers["posted"]),
    )
    hive.network.run(60.0)
    hive.post(Task("next", TaskType.GA, (Pose(3.0, 3.0, 0.0),)))
    hive.network.run(60.0)

    assert hive.record("next").state is TaskState.DONE
    assert hive.updates("odd")  # it is answered, whatever the answer


def test_a_text_of_ten_megabytes_is_refused_by_its_length():
    update = TaskUpdate("T1", TaskState.DONE, robot_id=HUGE)

    assert why_refused(TASK_STATE, update) == (
        f"TaskUpdate.robot_id has 10000000 characters; allowed: at most {MAX_NAME}"
    )


def test_an_order_for_a_task_of_unknown_type_is_refused():
    order = Order(Task("T1", 77, (Pose(0.0, 0.0, 0.0),)), "robot1")

    assert "type 77 is unknown" in why_refused(TASK_ASSIGN, order)
    assert "type 77 is unknown" in why_refused(
        TASK_ASSIGN, Order(Task("T1", 77, ()), "robot1", OrderKind.TAKE_BACK)
    )
