# SPDX-License-Identifier: BSD-3-Clause
"""The hive, which decides by its settings: a blackboard without a home, beside any robot."""

from __future__ import annotations

from random import Random
from typing import TYPE_CHECKING, Any

from blackboard.board.blackboard import Blackboard
from blackboard.consensus.journal import MemoryJournal
from blackboard.consensus.node import RaftNode
from blackboard.costing.cost import measure_for
from blackboard.domain.settings import (
    BlackboardSettings,
    ControllerSettings,
    RaftSettings,
    RobotSettings,
)
from blackboard.domain.task import StepKind
from blackboard.robot.executor import Controller
from blackboard.robot.robot import Robot
from hive_lab.virtual.inline_searcher import InlineSearcher

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.domain.path_lengths import PathLengths
    from hive_lab.architectures.trial import Trial, TrialRobot
    from hive_lab.fault_schedules.faulty_network import HostTalker

BLACKBOARD = "blackboard"


class AppendingRobot(Robot):
    """A robot of the report: what it is given goes to the end of its list, and so does its bid."""

    def __init__(self, *parts: Any, **more: Any) -> None:  # noqa: ANN401  (of Robot)
        super().__init__(*parts, **more)
        self._schedule.rule = lambda _: 0.0  # of positions that are equally good, the last


class Hive:
    """A hive in a trial; see `trial.Architecture`.

    As a launched fleet has it, the blackboard node and the first robots, which stand by, can carry
    the blackboard. The other robots hold the task list.

    Args:
        trial: The fleet, and how it decides.
        robot: The class of the robots.
        decision: How the blackboard decides, whatever the trial says.
        most_bids: Calls for bids are for so many tasks at most.
    """

    def __init__(
        self,
        trial: Trial,
        robot: type[Robot] = Robot,
        *,
        decision: str = "",
        most_bids: int = BlackboardSettings().most_bids,
    ) -> None:
        choices = trial.choices
        self._trial = trial
        self._settings = BlackboardSettings(
            decision=decision or choices.decision,
            improve_by=measure_for(choices.cost_model),
            bid_timeout=choices.bid_timeout,
            most_bids=most_bids,
        )
        self._robot_settings = RobotSettings(cost_model=choices.cost_model)
        self._robot = robot
        self._nodes: dict[str, RaftNode] = {}
        self._join(BLACKBOARD, stands_by=True).start()
        for number, each in enumerate(trial.robots.values()):
            self._join(each.name, stands_by=number < choices.stand_by, robot=each).start()

    @property
    def coordinator(self) -> str:
        """The leader."""
        return next((name for name, node in self._nodes.items() if node.may_act()), BLACKBOARD)

    def receivers(self, _: Random) -> None:
        """Post to whoever listens: the leader takes it."""

    def _join(self, name: str, *, stands_by: bool, robot: TrialRobot | None = None) -> RaftNode:
        talker = self._trial.boot(name)
        own = Random(self._trial.random.random())
        node = RaftNode(
            talker,
            name,
            RaftSettings(),
            MemoryJournal(),
            own,
            bootstrap=name == BLACKBOARD,
            voter=stands_by,
        )
        self._nodes[name] = node
        lengths = self._trial.path_lengths()
        if stands_by:
            Blackboard(
                talker,
                node,
                lengths(self._trial.least_radius),
                self._settings,
                path_lengths_for=lengths,
                searcher=InlineSearcher(talker),
            ).start()
        if robot is not None:
            self._add(robot, talker, node, lengths)
        return node

    def _add(
        self,
        robot: TrialRobot,
        talker: HostTalker,
        node: RaftNode,
        lengths: Callable[[float], PathLengths],
    ) -> None:
        body = robot.body
        commands = dict.fromkeys(StepKind, body)
        made = self._robot(
            talker,
            robot.name,
            robot.characteristics,
            body.battery.measured,
            lengths(robot.characteristics.radius),
            Controller(commands, talker.world, ControllerSettings()),
            body.pose,
            self._robot_settings,
            MemoryJournal(),
            node,
            self._trial.choices.charging,
        )
        body.moved = made.set_pose
        made.start()
