# SPDX-License-Identifier: BSD-3-Clause
"""A hive of the real classes that is kept at work, and what it says, as ROS sends it."""

from __future__ import annotations

import itertools
from collections import defaultdict, deque
from dataclasses import replace
from random import Random
from typing import TYPE_CHECKING

import numpy as np

from blackboard.board.blackboard import Blackboard
from blackboard.codec.tables import WIRES
from blackboard.consensus.journal import MemoryJournal
from blackboard.consensus.node import RaftNode
from blackboard.costing.grid_path_lengths import GridPathLengths
from blackboard.domain.settings import (
    BlackboardSettings,
    ControllerSettings,
    RaftSettings,
    RobotSettings,
)
from blackboard.domain.talker import NEW_TASK, SET_STATE, TASK_CANCEL, TASK_STATE
from blackboard.domain.task import StepKind, Task, TaskState, TaskType
from blackboard.robot.charging import ChargingPlan
from hive_common.grid_map import GridMap
from hive_common.pose import Pose
from hive_lab.fuzz.mutations import as_bytes
from hive_lab.virtual.hive import SMALL_ROBOT, TimedCommand, make_robot
from hive_lab.virtual.inline_searcher import InlineSearcher
from hive_lab.virtual.network import Encoded, Network, NetworkTalker

if TYPE_CHECKING:
    from collections.abc import Collection

    import genpy

    from blackboard.domain.record import TaskUpdate

BLACKBOARD = "blackboard"
ROBOTS = ("robot1", "robot2", "robot3", "robot4")

_KEPT = 40
"""Messages of each topic that are kept: the last ones, so that what they say is still true."""

_DATE = 1_000_000.0
"""All messages are stamped with it [s]: no run depends on the clock."""

_HALL = (100, 60)
"""Cells of the map, in x and in y."""

_CELL = 0.1  # side of a cell [m]

_CHARGERS = {"north": Pose(9.0, 5.0), "south": Pose(9.0, 1.0)}

_BODIES = {
    "robot1": SMALL_ROBOT,
    "robot2": replace(SMALL_ROBOT, radius=0.25),
    "robot3": replace(SMALL_ROBOT, arm_payload=0.0),
    "robot4": replace(
        SMALL_ROBOT, capabilities=frozenset({TaskType.GA, TaskType.GAB}), arm_payload=0.0
    ),
}

_TOO_HEAVY = 50.0  # for any one robot, so that it is split [kg]

_FORM_FOR = 6.0  # until all members have joined [s]


class _WireTalker(NetworkTalker):
    """A talker that keeps everything as ROS sends it; what ROS cannot send is an error."""

    def __init__(self, hive: HiveAtWork, member: str) -> None:
        super().__init__(hive.network, member)
        self._hive = hive

    def publish(self, topic: str, message: object, to: Collection[str] | None = None) -> None:
        """Publish, unless the process is dead."""
        if self.running:
            self._hive.keep(self._name(topic), topic, message)
        super().publish(topic, message, to)


class HiveAtWork:
    """A blackboard node and four robots, all of them members with a vote, on virtual time.

    Args:
        seed: Of everything that is random in it.
        decision: Of `BlackboardSettings`.

    Attributes:
        network: What connects them.
        said: The last messages by topic, each as bytes and with the name of the topic, which
            begins with its robot if the topic is a robot's own.
        talkers: By member; also of processes that have ended.
        posted: The ids of the tasks so far.
    """

    def __init__(self, seed: int, decision: str) -> None:
        self.network = Network(survives=True)
        self.said: dict[str, deque[tuple[str, bytes]]] = defaultdict(lambda: deque(maxlen=_KEPT))
        self.talkers: list[NetworkTalker] = []
        self.posted: list[str] = []
        self._random = Random(seed)
        self._settings = BlackboardSettings(decision=decision)
        self._disks: dict[str, MemoryJournal] = defaultdict(MemoryJournal)
        self._running: dict[str, NetworkTalker] = {}
        self._places = {
            name: Pose(1.0 + number, 1.0 + number) for number, name in enumerate(ROBOTS)
        }
        self._done: set[str] = set()
        self._ids = itertools.count(1)
        hall = np.zeros(_HALL[::-1], dtype=bool)
        hall[:40, 50] = True
        self._hall = GridMap.of_blocked(hall, _CELL)
        self._lengths: dict[float, GridPathLengths] = {}
        self.network.listen(TASK_STATE, self._hear)
        for name in (BLACKBOARD, *ROBOTS):
            self.boot(name)
        self.network.run(_FORM_FOR)

    def boot(self, name: str) -> None:
        """Start the process of a member, or start it again."""
        self.kill(name)
        talker = self._running[name] = _WireTalker(self, name)
        self.talkers.append(talker)
        disk, is_robot = self._disks[name], name in ROBOTS
        chance = Random(self._random.random())
        settings = RaftSettings()
        node = RaftNode(talker, name, settings, disk, chance, bootstrap=not is_robot)
        lengths = self._path_lengths
        searcher = InlineSearcher(talker)
        Blackboard(
            talker,
            node,
            lengths(0.3),
            self._settings,
            path_lengths_for=lengths,
            searcher=searcher,
        ).start()
        if is_robot:
            self._robot(name, talker, node, disk)
        node.start()

    def kill(self, name: str) -> None:
        """End the process of a member; harmless if it does not run."""
        if (talker := self._running.pop(name, None)) is not None:
            talker.running = False

    def say(self, topic: str, message: object, own: str = "") -> None:
        """Say something as an operator does; `own` is the robot whose topic it is."""
        name = f"{own}/{topic}" if own else topic
        self.keep(name, topic, message)
        self.network.send(name, message)

    def keep(self, name: str, topic: str, message: object) -> None:
        """Keep a message that is sent."""
        self.said[topic].append((name, as_bytes(WIRES[topic].to_msg(message, _DATE))))

    def deliver(self, name: str, topic: str, message: genpy.Message) -> None:
        """Have all members hear a message that none of them has sent."""
        self.network.deliver(name, Encoded(message, WIRES[topic].from_msg))

    def go_on(self, number: int) -> None:
        """Do the next thing that an operator of a busy hive does."""
        deeds = (
            lambda: self.post(TaskType.GA),
            lambda: self.post(TaskType.GPAB, payload=2.0),
            lambda: self.say(SET_STATE, "defect", ROBOTS[number % 3]),
            lambda: self.post(TaskType.GAB, payload=_TOO_HEAVY),
            lambda: self.say(TASK_CANCEL, self._random.choice(self.posted[-4:])),
            lambda: self.kill(ROBOTS[-1 - number % 2]),
            lambda: self.post(TaskType.GPA, payload=1.0, priority=10),
            self.all_good,
            lambda: self.say(SET_STATE, "charging", ROBOTS[1]),
            lambda: self.kill(BLACKBOARD),
            lambda: self.post(TaskType.GAB, payload=5.0),
        )
        deeds[number % len(deeds)]()

    def post(self, kind: TaskType, payload: float = 0.0, priority: int = 1) -> str:
        """Post a task between random places; return its id."""
        task_id = f"T{next(self._ids)}"
        goals = tuple(
            Pose(self._random.uniform(0.5, 4.5), self._random.uniform(0.5, 5.5))
            for _ in range(kind.goals_needed)
        )
        posted = float(int(self.network.now))
        self.say(NEW_TASK, Task(task_id, kind.value, goals, priority, payload, "map", posted))
        self.posted.append(task_id)
        return task_id

    def all_good(self) -> None:
        """Start what does not run, and put all robots to work again."""
        for name in (BLACKBOARD, *ROBOTS):
            if name not in self._running:
                self.boot(name)
        for name in ROBOTS:
            self.say(SET_STATE, "idle", name)

    def does(self, task_id: str, within: float) -> bool:
        """Return whether a posted task is done within a time [s]."""
        return self.network.run_until(lambda: task_id in self._done, within)

    def _path_lengths(self, radius: float) -> GridPathLengths:
        if radius not in self._lengths:
            self._lengths[radius] = GridPathLengths(self._hall, radius)
        return self._lengths[radius]

    def _robot(
        self, name: str, talker: NetworkTalker, node: RaftNode, disk: MemoryJournal
    ) -> None:
        command = TimedCommand(self.network, lambda _: self._random.uniform(1.0, 4.0))
        body = _BODIES[name]
        robot = make_robot(
            talker,
            name,
            self._places[name],
            dict.fromkeys(StepKind, command),
            body,
            path_lengths=self._path_lengths(body.radius),
            controller=ControllerSettings(retry_delay=1.0),
            settings=RobotSettings(cost_model="latency" if name == "robot2" else "report"),
            journal=disk,
            hive_filter=node,
            charging=ChargingPlan(_CHARGERS),
        )

        def arrive(pose: Pose) -> None:
            if talker.running:
                self._places[name] = pose
                robot.set_pose(pose)

        command.arrive = arrive
        robot.start()

    def _hear(self, update: TaskUpdate | Encoded) -> None:
        # What the fuzz tells counts for nothing.
        if not isinstance(update, Encoded) and update.state is TaskState.DONE:
            self._done.add(update.task_id)
