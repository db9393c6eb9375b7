# SPDX-License-Identifier: BSD-3-Clause
"""A simulated hive with everything that watches it and acts on it: checker, injector, operator."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.domain.talker import NEW_TASK, TASK_STATE
from blackboard.domain.task import TaskState
from hive_lab.fault_schedules.features.exercised import Exercised
from hive_lab.fault_schedules.injector import FaultInjector
from hive_lab.fault_schedules.protocol_checker import ProtocolChecker
from hive_lab.fault_schedules.schedule import OPERATOR

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from blackboard.domain.record import TaskUpdate
    from blackboard.domain.task import Task
    from hive_lab.fault_schedules.faulty_network import FaultyNetwork
    from hive_lab.fault_schedules.simulated_member import SimulatedMember

REPEAT = 1.5  # the operator's program posts a task again after this time without an answer [s]


class Harness:
    """Base of a simulated hive; a subclass makes the members and hands them to `connect`.

    The generator of `network` is the source of every chance.
    """

    def __init__(self, network: FaultyNetwork) -> None:
        self.random = network.random
        self.exercised = Exercised()
        self.network = network
        self.answered: set[str] = set()

    def connect(self, members: Mapping[str, SimulatedMember], tasks: Sequence[Task]) -> None:
        """Connect checker, injector and operator, once every member has its host."""
        self.members = members
        self.checker = ProtocolChecker(members, tasks, lambda: self.network.now, self.exercised)
        self.injector = FaultInjector(self.network, members, self.checker)
        self.network.after_event = self.checker.after_event
        self.network.said = self.checker.said
        self.operator = self.network.add_host(OPERATOR)
        self.operator.up = True
        self.operator.handlers[TASK_STATE] = [self._hear]

    def start(
        self, members: Iterable[SimulatedMember], late: Mapping[str, float] | None = None
    ) -> None:
        """Schedule every member's start: at its time in `late` [s], or within the first second."""
        for member in members:
            member.at_work, member.step_done = self.checker.at_work, self.checker.step_done
            member.heads_for = self.checker.chargers.heads_for
            self.checker.loads.follow(member.name, member.arm)
            at = (late or {}).get(member.name)
            chance = self.random.uniform(0.0, 1.0)
            self.network.schedule(chance if at is None else at, None, self.injector.boot, member)

    def post(self, task: Task) -> None:
        """Post a task, again and again until the blackboard answers."""
        if task.id not in self.answered:
            self.network.send(self.operator, NEW_TASK, task)
            self.network.schedule(REPEAT, None, self.post, task)

    def post_anew(self, task: Task) -> None:
        """Post a task under the id of an earlier one, once that was answered.

        An answer names the id only, so it would count for both.
        """
        if task.id in self.answered:
            self.answered.discard(task.id)
            self.post(task)
        else:
            self.network.schedule(REPEAT, None, self.post_anew, task)

    def _hear(self, update: TaskUpdate) -> None:
        """Take any answer of the blackboard."""
        if not update.robot_id or update.state is not TaskState.WAITING:
            self.answered.add(update.task_id)
