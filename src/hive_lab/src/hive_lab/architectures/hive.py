# SPDX-License-Identifier: BSD-3-Clause
"""The hive, which decides by its settings: a blackboard without a home, beside any robot."""

from __future__ import annotations

from random import Random
from typing import TYPE_CHECKING, Any

from blackboard.board.blackboard import Blackboard
from blackboard.consensus.journal import MemoryJournal
from blackboard.consensus.node import RaftNode
from blackboard.domain.settings import (
    STANDING_BY,
    BlackboardSettings,
    ControllerSettings,
    RaftSettings,
    RobotSettings,
)
from blackboard.domain.task import StepKind
from blackboard.robot.executor import Controller
from blackboard.robot.robot import Robot
from hive_lab.architectures.trial import MODELS, characteristics
from hive_lab.virtual.inline_searcher import InlineSearcher

if TYPE_CHECKING:
    from collections.abc import Callable

    from hive_lab.architectures.grounds import NodePathLengths
    from hive_lab.architectures.metering import MeteredTalker
    from hive_lab.architectures.trial import Trial, TrialRobot

BLACKBOARD = "blackboard"


class AppendingRobot(Robot):
    """A robot of the report: what it is given goes to the end of its list, and so does its bid."""

    def __init__(self, *parts: Any, **more: Any) -> None:  # noqa: ANN401  (of Robot)
        super().__init__(*parts, **more)
        self._schedule.rule = lambda _: 0.0  # of positions that are equally good, the last


class Hive:
    """A hive in a trial; see `trial.Architecture`.

    As a launched fleet has it, the blackboard node and the first `STANDING_BY` robots can carry
    the blackboard. The other robots hold the task list.

    Args:
        trial: The fleet.
        settings: How the blackboard decides.
        cost_model: With which robots bid.
        robot: The class of the robots.
    """

    def __init__(
        self,
        trial: Trial,
        settings: BlackboardSettings,
        cost_model: str,
        robot: type[Robot] = Robot,
    ) -> None:
        self._trial = trial
        self._settings = settings
        self._robot_settings = RobotSettings(cost_model=cost_model)
        self._robot = robot
        self._nodes: dict[str, RaftNode] = {}
        self._join(BLACKBOARD, stands_by=True).start()
        for number, each in enumerate(trial.robots.values()):
            self._join(each.name, stands_by=number < STANDING_BY, robot=each).start()

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
                lengths(characteristics(MODELS[0]).radius),
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
        talker: MeteredTalker,
        node: RaftNode,
        lengths: Callable[[float], NodePathLengths],
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
        )
        body.moved = made.set_pose
        made.start()
