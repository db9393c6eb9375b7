# SPDX-License-Identifier: BSD-3-Clause
"""What must always hold in a hive, checked after every event; docs/protocol.md says why it does.

The checker sees everything: every disk, every message as it is sent, every robot's wheels. A
broken property ends the run with a `Violation` that names it.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import TYPE_CHECKING

from blackboard.member import Role, has_lease, is_majority, name_of
from blackboard.record import Order, TaskRecord, TaskUpdate
from blackboard.talker import TASK_ASSIGN, TASK_STATE
from blackboard.task import TaskState, split_task

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from blackboard.journal import Durable
    from blackboard.member import Member
    from blackboard.replication import Entry, Position
    from blackboard.simulation.hive import SimulatedMember
    from blackboard.simulation.network import Host
    from blackboard.task import Task, TaskStep


class Violation(AssertionError):  # noqa: N818  (the word the docs use)
    """A property does not hold; the text says which, when, and what was seen."""


class Properties:
    """Watches one hive.

    Args:
        members: All that there are, by name.
        tasks: That are going to be posted.
        now: Gives the true time [s].

    Attributes:
        takeovers: How many members have become active.
        done: Tasks that a robot has really finished, and how often.
        truth: Every task as it was last committed.
    """

    def __init__(
        self,
        members: Mapping[str, SimulatedMember],
        tasks: Iterable[Task],
        now: Callable[[], float],
    ) -> None:
        self._members = members
        self._last_steps = {task.id: split_task(task)[-1] for task in tasks}
        self._now = now
        self._seen: dict[str, Member] = {}
        self._active_of: dict[int, str] = {}
        self._active_now: set[str] = set()
        self._history: dict[int, Position] = {}
        self._written: dict[Position, Entry] = {}
        self._applied = 0
        self._lost_disks: list[Durable | None] = []
        self._told: set[tuple[str, int, str]] = set()
        self._workers: dict[str, set[str]] = defaultdict(set)
        self._finishers: dict[str, str] = {}
        self._handed_back: set[tuple[str, str, int]] = set()
        self._lost: set[str] = set()
        self.takeovers = 0
        self.done: Counter[str] = Counter()
        self.truth: dict[str, TaskRecord] = {}

    def after_event(self, host: Host) -> None:
        """Check what can have changed with an event on a host."""
        backup = self._members[host.name].backup
        if backup is None or not host.up:
            self._active_now.discard(host.name)
            self._seen.pop(host.name, None)
            return
        member = backup.member
        before = self._seen.get(host.name)
        if member is before:
            return
        self._seen[host.name] = member
        if before is None or member.log is not before.log:
            self._follow_commits(member, before)
        if member.role is Role.ACTIVE:
            if before is None or before.role is not Role.ACTIVE:
                self._check_takeover(member)
            self._check_lease(host, member)
        else:
            self._active_now.discard(host.name)

    def said(self, host: Host, topic: str, message: object) -> None:
        """Check what a host is about to say."""
        if topic == TASK_STATE and isinstance(message, TaskUpdate):
            if message.robot_id and message.state is TaskState.WAITING:
                report = message.task_id, message.robot_id, message.assignment
                self._handed_back.add(report)
            by_blackboard = not message.robot_id or message.state is TaskState.ASSIGNED
            if by_blackboard and message.state in {TaskState.WAITING, TaskState.ASSIGNED}:
                self._check_is_safe(host, message.task_id, message.assignment, message.state.name)
        elif topic == TASK_ASSIGN and isinstance(message, Order) and not message.take_back:
            self._check_is_safe(host, message.task.id, message.assignment, "an order")

    def at_work(self, robot: str, task: str, works: bool) -> None:
        """Note that a robot works on a task, or no longer does."""
        workers = self._workers[task]
        if not works:
            workers.discard(robot)
            return
        workers.add(robot)
        if len(workers) > 1:
            self._broken("never two robots", f"{' and '.join(sorted(workers))} work on {task}")

    def stopped(self, robot: str) -> None:
        """Note that a robot's process has ended, and its wheels with it."""
        for workers in self._workers.values():
            workers.discard(robot)

    def step_done(self, robot: str, step: TaskStep) -> None:
        """Note that a robot has done a step."""
        task = step.task_id
        if step != self._last_steps.get(task):
            return
        self.done[task] += 1
        self._finishers[task] = robot
        if self.done[task] > 1 and task not in self._lost:
            self._broken("done once", f"{robot} finishes {task}, which was finished before")

    def disk_lost(self, robot: str, durable: Durable | None) -> None:
        """Allow what a robot did to be done again: its disk is lost, and its reports with it."""
        self._lost_disks.append(durable)
        for task, finisher in self._finishers.items():
            if finisher == robot and not self._is_known_as_done(task):
                self.done[task] = 0

    def _is_known_as_done(self, task: str) -> bool:
        record = self.truth.get(task)
        return record is not None and record.state.is_terminal

    def at_end(self) -> None:
        """Check, when all has been calm for long, that every task ended or says why not."""
        for task_id in sorted(self._last_steps):
            record = self.truth.get(task_id)
            if record is None:
                self._broken("it goes on", f"{task_id} was never taken in")
            elif not record.state.is_terminal and not record.reason:
                self._broken(
                    "it goes on", f"{task_id} is {record.state.name} and does not say why"
                )

    def _follow_commits(self, member: Member, before: Member | None) -> None:
        """Check that what a member holds as committed is what everyone else does."""
        log = member.log
        for entry in log.entries:
            self._written[entry.position] = entry
        first = 0 if before is None else before.log.committed
        base = log.base.position
        folded = before.log if before and before.log.at(base.version) == base else log
        for version in range(first, log.committed + 1):
            # What has been folded in this very event was still to be seen before it.
            position = log.at(version) or folded.at(version)
            if position is None:
                continue
            known = self._history.setdefault(version, position)
            if known != position:
                self._broken(
                    "one history",
                    f"{member.id} has committed {position} where another committed {known}",
                )
            if position in self._written:
                self._apply(member, version, self._written[position].records)

    def _apply(self, member: Member, version: int, records: tuple[TaskRecord, ...]) -> None:
        if version <= self._applied:
            return
        self._applied = version
        for record in records:
            known = self.truth.get(record.task.id)
            self.truth[record.task.id] = record
            if known is not None:
                self._check_left(known, record)
            if known is not None and known.state.is_terminal and record.state != known.state:
                self._broken(
                    "done once",
                    f"{member.id} turns {record.task.id} from {known.state.name} "
                    f"to {record.state.name}",
                )

    def _check_left(self, before: TaskRecord, after: TaskRecord) -> None:
        """Check that a robot from which a task is taken unasked has stopped, because it is lost.

        What such a robot has done, another may do again: `on_robot_lost` is `reassign` here.
        """
        name, robot = before.task.id, before.robot
        held = before.is_held and not after.state.is_terminal
        stays = (after.robot, after.assignment) == (robot, before.assignment)
        if not held or stays or (name, robot, before.assignment) in self._handed_back:
            return
        self._lost.add(name)
        if robot in self._workers[name]:
            self._broken("never two robots", f"{name} is taken from {robot}, which is at it")

    def _check_takeover(self, member: Member) -> None:
        self.takeovers += 1
        rival = self._active_of.setdefault(member.epoch, member.id)
        if rival != member.id:
            self._broken(
                "one authority", f"{rival} and {member.id} are both active in epoch {member.epoch}"
            )
        missing = self._applied - member.log.position.version
        lost = [task_id for task_id in self.truth if task_id not in member.log.latest.records]
        if missing > 0 or lost:
            self._broken(
                "nothing is lost",
                f"{member.id} becomes active and lacks {missing} changes; tasks missing: {lost}",
            )

    def _check_lease(self, host: Host, member: Member) -> None:
        self._active_now.add(host.name)
        for name in tuple(self._active_now - {host.name}):
            other = self._members[name]
            if other.backup is None or not other.host.up:
                self._active_now.discard(name)
                continue
            now = self._now()
            if has_lease(member, now * host.rate) and has_lease(
                other.backup.member, now * other.host.rate
            ):
                self._broken(
                    "one authority", f"{name} and {host.name} may both act as the active one"
                )

    def _check_is_safe(self, host: Host, task_id: str, assignment: int, what: str) -> None:
        """Check that a majority has on disk what is being told for the first time."""
        backup = self._members[host.name].backup
        if backup is None or (task_id, assignment, what) in self._told:
            return
        self._told.add((task_id, assignment, what))
        log = backup.member.log
        # While the list of members changes, majorities of the old and the new one overlap.
        lists = (log.stable.members, log.latest.members)
        disks = [member.disk.durable for member in self._members.values()]
        holders = set()
        for durable in (*disks, *self._lost_disks):
            record = durable.log.latest.records.get(task_id) if durable else None
            if durable and record and record.assignment >= assignment:
                holders.add(durable.member)
        if not any(is_majority(holders, listed) for listed in lists):
            names = ", ".join(map(name_of, lists[-1]))
            self._broken(
                "nothing is lost",
                f"{host.name} tells {what} of {task_id}, which {len(holders)} hold; "
                f"the members are {names}",
            )

    def _broken(self, which: str, what: str) -> None:
        raise Violation(f"at {self._now():.3f} s: {which}: {what}")
