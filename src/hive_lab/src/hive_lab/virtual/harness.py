# SPDX-License-Identifier: BSD-3-Clause
"""One blackboard or one robot, with the test in the role of all other members."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from blackboard.consensus.task_list import TaskList
from blackboard.costing.bid_basis import BidBasis, Bids
from blackboard.costing.grid_path_lengths import GridPathLengths
from blackboard.domain.battery import Battery
from blackboard.domain.bid import MAX_COST, Bid, CostTerms
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.charger import Grant
from blackboard.domain.record import Broadcast, Order, OrderKind, TaskRecord, TaskUpdate
from blackboard.domain.settings import BlackboardSettings, ControllerSettings
from blackboard.domain.talker import (
    NEW_TASK,
    ROBOT_STATUS,
    SYNC,
    TASK_ASSIGN,
    TASK_BROADCAST,
    TASK_CANCEL,
    TASK_COST,
    TASK_STATE,
)
from blackboard.domain.task import StepKind
from hive_common.grid_map import GridMap
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT, Listener, TimedCommand, make_robot, start_blackboard
from hive_lab.virtual.network import Network, NetworkTalker

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.auction.decision import Decision
    from blackboard.consensus.hive_filter import HiveFilter
    from blackboard.consensus.journal import Journal
    from blackboard.domain.task import Task, TaskState
    from blackboard.robot.charging import ChargingPlan

SOON = 0.01  # more than any message takes [s]
STEP = 10.0  # duration of every step [s]

SLOW_ROBOT = replace(SMALL_ROBOT, max_speed=0.1)
"""To it, ways on the floor of `BlackboardHarness` are worth a plan."""


class _Harness:
    """A private network, and the messages on it."""

    def __init__(self) -> None:
        self.network = Network()

    def wait(self, duration: float = SOON) -> None:
        """Let time pass [s]."""
        self.network.run(duration)

    def send(self, topic: str, message: object) -> None:
        """Publish a message as another member."""
        self.network.send(topic, message)
        self.wait()

    def said(self, topic: str) -> list[Any]:
        """Return every message on a topic."""
        return [message for name, message in self.network.heard if name == topic]


class BlackboardHarness(_Harness):
    """A blackboard on a floor of 4 m x 4 m with a wall; `settings` are of `BlackboardSettings`.

    `decisions` holds what the auctions decided, oldest first.
    """

    def __init__(self, **settings: Any) -> None:  # noqa: ANN401  (of BlackboardSettings)
        super().__init__()
        self.talker = NetworkTalker(self.network, "blackboard")
        blocked = np.zeros((40, 40), dtype=bool)
        blocked[:, 20] = True
        lengths = GridPathLengths(GridMap.of_blocked(blocked, 0.1))
        self.decisions: list[Decision] = []
        start_blackboard(
            self.talker, lengths, BlackboardSettings(**settings), self.decisions.extend
        )

    def join(self, *robots: str) -> None:
        """Announce robots."""
        for robot in robots:
            self.status(robot)

    def status(
        self, robot: str, state: RobotState = RobotState.IDLE, tasks: tuple[str, ...] = ()
    ) -> None:
        """Publish a robot's status."""
        status = RobotStatus(robot, state, Pose(0.0, 0.0), charge=0.8, tasks=tuple(tasks))
        self.send(ROBOT_STATUS, status)

    def post(self, *tasks: Task) -> None:
        """Post tasks at once."""
        for task in tasks:
            self.network.send(NEW_TASK, task)
        self.wait()

    def cancel(self, task_id: str) -> None:
        """Cancel a task."""
        self.send(TASK_CANCEL, task_id)

    def bid(self, robot: str, auction: int | None = None, **costs: float) -> None:
        """Bid a cost for each task, in the last auction or another one."""
        self._answer(robot, costs, auction)

    def tell(self, robot: str, pose: Pose, *tasks: str, auction: int | None = None) -> None:
        """Tell what a robot's bids are made from: where it is, and the tasks on its list.

        It is one of `SLOW_ROBOT`, and answers the last call or that of another auction.
        """
        asked = self.said(TASK_BROADCAST)[-1]
        listed = tuple((task_id, 0) for task_id in tasks)
        basis = BidBasis(SLOW_ROBOT, "latency", 120.0, pose, 0.8, tasks=listed)
        number = auction or asked.auction
        self.send(TASK_COST, Bids(robot, 1, number, (), asked.round, basis))

    def report(
        self,
        robot: str,
        task: Task,
        state: TaskState,
        assignment: int = 1,
        **fields: Any,  # noqa: ANN401  (of TaskUpdate)
    ) -> None:
        """Report on a task as a robot."""
        update = TaskUpdate(task.id, state, robot, assignment=assignment)
        self.send(TASK_STATE, replace(update, **fields))

    def assign(self, task: Task, robot: str = "robot1") -> None:
        """Let a robot win a task."""
        self.join(robot)
        self.post(task)
        self._answer(robot, {task.id: 1.0})

    def states(self, task: Task) -> list[tuple[TaskState, str]]:
        """Return (state, robot) of every update on a task."""
        said = self.said(TASK_STATE)
        return [(update.state, update.robot_id) for update in said if update.task_id == task.id]

    def orders(self, *kinds: OrderKind) -> list[tuple[str, str]]:
        """Return (task, robot) of the orders of some kinds, by default of assignments."""
        said = self.said(TASK_ASSIGN)
        return [
            (each.task.id, each.robot_id)
            for each in said
            if each.kind in (kinds or [OrderKind.ASSIGN])
        ]

    def record(self, task: Task) -> TaskRecord | None:
        """Return a task's record from the task list."""
        self.wait(0.3)
        records: tuple[TaskRecord, ...] = self.said(SYNC)[-1].records
        return next((record for record in records if record.task.id == task.id), None)

    @property
    def offered(self) -> list[str]:
        """The task ids of the last broadcast."""
        return [task.id for task, _ in self.said(TASK_BROADCAST)[-1].tasks]

    def _answer(self, robot: str, costs: Mapping[str, float], auction: int | None = None) -> None:
        asked = self.said(TASK_BROADCAST)[-1]
        number = auction or asked.auction
        bids = tuple(
            Bid(
                robot,
                name,
                cost,
                eta=10.0,
                reason="cannot" if cost == MAX_COST else "",
                terms=CostTerms(1.0, 1.0, 1, cost, 10.0, cost, cost),
            )
            for name, cost in costs.items()
        )
        self.send(TASK_COST, Bids(robot, 1, number, bids, asked.round))


class RobotHarness(_Harness):
    """robot1 at (0, 0), with a battery charged to 0..1, and the filter of a member beside it.

    What its process wrote down before it restarted is in `journal`; by default that is new.
    """

    def __init__(
        self,
        charge: float = 1.0,
        hive_filter: HiveFilter | None = None,
        charging: ChargingPlan | None = None,
        journal: Journal | None = None,
    ) -> None:
        super().__init__()
        self.listener = Listener(self.network)
        self.talker = NetworkTalker(self.network, "robot1")
        self.battery = Battery(SMALL_ROBOT.battery, charge)
        self.command = TimedCommand(self.network, lambda _: STEP)
        self.missing = ""  # what keeps its commands from working at all
        self.robot = make_robot(
            self.talker,
            "robot1",
            Pose(0.0, 0.0),
            dict.fromkeys(StepKind, self.command),
            battery=self.battery,
            controller=ControllerSettings(attempts=2, retry_delay=1.0),
            hive_filter=hive_filter,
            charging=charging,
            journal=journal,
            missing=lambda: self.missing,
        )
        self.command.arrive = self.robot.set_pose
        self.robot.start()
        self.wait()

    def order(
        self,
        task: Task,
        assignment: int = 1,
        **fields: Any,  # noqa: ANN401  (of Order)
    ) -> None:
        """Order a task as the blackboard."""
        heard = self.network.now
        order = Order(task, "robot1", epoch=1, assignment=assignment, heard=heard)
        self.send(TASK_ASSIGN, replace(order, **fields))

    def know(
        self,
        task: Task,
        state: TaskState,
        robot: str = "robot1",
        assignment: int = 1,
        version: int = 1,
    ) -> None:
        """Publish a task list of one task as the blackboard."""
        record = TaskRecord(task, state, robot=robot, assignment=assignment)
        self.send(SYNC, TaskList(1, version, (record,)))

    def give_chargers(self, version: int, since: float | None = None, **robots: str) -> None:
        """Publish a task list in which each charger, by name, was given to a robot, or to none.

        The grants answer requests that were made at a time [s], by default the last one of robot1.
        """
        asked = self.status.charger_since if since is None else since
        grants = tuple(Grant(name, robot, asked) for name, robot in robots.items() if robot)
        self.send(SYNC, TaskList(1, version, grants=grants))

    def set_state(self, word: str) -> None:
        """Set its state as an operator."""
        self.send("robot1/set_state", word)

    def bids(self, *tasks: Task) -> Bids:
        """Call for bids and return its answer."""
        offers = tuple((task, 0) for task in tasks)
        self.send(TASK_BROADCAST, Broadcast(1, 7, offers))
        answer: Bids = self.said(TASK_COST)[-1]
        return answer

    def reports(self, task: Task) -> list[tuple[TaskState, int]]:
        """Return (state, step) of every report on a task."""
        said = self.said(TASK_STATE)
        return [(update.state, update.step) for update in said if update.task_id == task.id]

    @property
    def status(self) -> RobotStatus:
        """Its last status."""
        status: RobotStatus = self.said(ROBOT_STATUS)[-1]
        return status
