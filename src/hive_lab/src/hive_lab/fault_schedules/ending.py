# SPDX-License-Identifier: BSD-3-Clause
"""What must hold after a long calm: there is one hive, and every task has ended."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, NoReturn

from blackboard.consensus.member import Role
from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping

    from blackboard.consensus.member import Member
    from blackboard.domain.record import TaskRecord
    from hive_lab.fault_schedules.history import History
    from hive_lab.fault_schedules.simulated_member import SimulatedMember


class Ending:
    """Knows the state of every task, and whether the run is over.

    Args:
        members: All members, by name.
        hives: What each hive has committed, by id.
        broken: Ends the run; takes the broken property and the observation.
    """

    def __init__(
        self,
        members: Mapping[str, SimulatedMember],
        hives: Mapping[str, History],
        tasks: Collection[str],
        broken: Callable[[str, str], NoReturn],
    ) -> None:
        self._members = members
        self._hives = hives
        self._tasks = tasks
        self._broken = broken

    @property
    def truth(self) -> Mapping[str, TaskRecord]:
        """Every task as last committed in the hive that most members belong to.

        Tasks that ended in a hive that is gone stay as they ended there.
        """
        ended = {
            name: record
            for hive in self._hives.values()
            for name, record in {**hive.forgotten, **hive.truth}.items()
            if record.state.is_terminal
        }
        return {**ended, **self._hives[self.greatest()].truth}

    def is_over(self) -> bool:
        """Return whether there is one hive, and every task has ended.

        Nor may any robot repeat a report that the hive does not answer.
        """
        if not self.is_one_hive() or self._unanswered():
            return False
        truth = self.truth
        over = {task_id for task_id, record in truth.items() if self._is_over(record)}
        return set(self._tasks) <= over

    def _is_over(self, record: TaskRecord) -> bool:
        """Return whether a task has ended, or needs a robot that there is not."""
        if record.parts:
            parts = (each for each in self.truth.values() if each.parent == record.task.id)
            return record.state.is_terminal or all(map(self._is_over, parts))
        return (
            record.state.is_terminal
            or self._waits_for_gone_robot(record)
            or self._nobody_can(record)
        )

    def _waits_for_gone_robot(self, record: TaskRecord) -> bool:
        """Return whether `on_robot_lost: wait` keeps a task for a robot that never comes back."""
        robot = self._members.get(record.robot)
        return (
            record.is_held
            and robot is not None
            and robot.gone
            and robot.board.on_robot_lost == "wait"
        )

    def _nobody_can(self, record: TaskRecord) -> bool:
        """Return whether a task waits that no robot can do which is not gone."""
        return record.state is TaskState.WAITING and all(
            each.kit.characteristics.excludes(record.task) or self._is_stranded(each)
            for each in self._members.values()
            if each.drive is not None and not each.gone
        )

    def _is_stranded(self, robot: SimulatedMember) -> bool:
        """Return whether a robot's battery is empty and gone robots stand at all its chargers.

        Only a person can help it.
        """
        blocked = {each.pose for each in self._members.values() if each.gone}
        chargers = set(robot.kit.charging.chargers.values())
        return bool(chargers) and robot.battery.level <= 0.0 and chargers <= blocked

    def greatest(self) -> str:
        """Return the id of the hive that goes on: one with a leader, else that of most members."""
        known = [each.disk.hard_state for each in self._members.values() if not each.gone]
        hives = Counter(
            hard_state.hive for hard_state in known if hard_state is not None and hard_state.hive
        )
        led = self._led()
        return max(hives, key=lambda hive: (hive in led, hives[hive], hive), default="")

    def check(self) -> None:
        """Check that there is one hive and that every task has ended."""
        if not self.is_one_hive():
            self._broken("one hive", f"there are {', '.join(self._running_hives())}")
        if told := self._unanswered():
            self._broken("it goes on", f"{', '.join(told)}, unanswered")
        for task_id in sorted(self._tasks):
            record = self.truth.get(task_id)
            if record is None:
                self._broken("it goes on", f"{task_id} was never accepted")
            elif not self._is_over(record):
                self._broken(
                    "it goes on",
                    f"{task_id} is {record.state.name}: {record.reason or 'no reason'}",
                )
            elif record.state is TaskState.FAILED and not record.reason:
                self._broken("it goes on", f"{task_id} has FAILED and does not say why")

    def _unanswered(self) -> list[str]:
        """Return the unacknowledged reports of the hive's robots."""
        return [
            f"{name} reports {report.task_id} as {report.state.name}"
            for name, member in self._members.items()
            if member.host.up and member.disk.hard_state and not member.gone
            for report in member.disk.reports
            if member.disk.hard_state.hive == self.greatest()
        ]

    def is_one_hive(self) -> bool:
        """Return whether all members that run belong to the same hive."""
        return len(self._running_hives()) <= 1

    def _running_hives(self) -> set[str]:
        return {member.hive for member in self._running()}

    def _led(self) -> set[str]:
        """Return the hives in which a member is the leader."""
        return {member.hive for member in self._running() if member.role is Role.LEADER}

    def _running(self) -> Iterator[Member]:
        """Return the states of all members that run."""
        for each in self._members.values():
            if each.host.up and each.node is not None:
                yield each.node.member
