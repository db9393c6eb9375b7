# SPDX-License-Identifier: BSD-3-Clause
"""What must always hold in a hive, checked after every event; docs/protocol.md says why it does.

The checker sees everything: every disk, every message as it is sent, every robot's wheels. A
broken property ends the run with a `Violation` that names it.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import TYPE_CHECKING, NoReturn

from blackboard.consensus.member import Role, has_lease, is_majority, name_of
from blackboard.consensus.task_list import TaskList
from blackboard.domain.record import Order, TaskRecord, TaskUpdate
from blackboard.domain.talker import BACKUP, TASK_ASSIGN, TASK_BROADCAST, TASK_STATE
from blackboard.domain.task import TaskState, split_task
from hive_lab.fault_schedules.ending import Ending
from hive_lab.fault_schedules.history import History, Violation

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from blackboard.consensus.journal import HardState
    from blackboard.consensus.member import Member
    from blackboard.domain.task import Task, TaskStep
    from hive_lab.fault_schedules.faulty_network import Host
    from hive_lab.fault_schedules.simulated_member import SimulatedMember


class ProtocolChecker:
    """Watches one hive.

    Args:
        members: All that there are, by name.
        tasks: That are going to be posted.
        now: Gives the true time [s].

    Attributes:
        ending: What must be so in the end.
        takeovers: How many members have become active.
        done: Tasks that a robot has really finished, and how often.
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
        self._leader_now: set[str] = set()
        self._ended: Counter[str] = Counter()
        self._hives: dict[str, History] = defaultdict(lambda: History(self._broken, self._ended))
        self._lost_disks: list[HardState | None] = []
        self._told: set[tuple[str, str, int, str]] = set()
        self._workers: dict[str, set[str]] = defaultdict(set)
        self._finishers: dict[str, str] = {}
        self._finished: set[str] = set()
        self._handed_back: set[tuple[str, str, int]] = set()
        self._lost: set[str] = set()
        self.ending = Ending(members, self._hives, self._last_steps, self._broken)
        self.takeovers = 0
        self.done: Counter[str] = Counter()

    def after_event(self, host: Host) -> None:
        """Check what can have changed with an event on a host."""
        own = self._members.get(host.name)
        if own is None:
            return  # the operator's
        backup = own.backup
        if backup is None or not host.up:
            self._leader_now.discard(host.name)
            self._seen.pop(host.name, None)
            return
        member = backup.member
        before = self._seen.get(host.name)
        if member is before:
            return
        self._seen[host.name] = member
        if before is None or member.log is not before.log:
            self._follow_commits(member, before)
        if member.role is Role.LEADER:
            if before is None or before.role is not Role.LEADER:
                self._check_takeover(member)
            self._check_lease(host, member)
        else:
            self._leader_now.discard(host.name)

    def said(self, host: Host, topic: str, message: object) -> None:
        """Check what a host is about to say."""
        if topic in {BACKUP, TASK_BROADCAST, TASK_ASSIGN}:
            self._check_may_say(host, topic)
        self._note_told(message)
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
        self._finished.add(task)
        self._finishers[task] = robot
        if self.done[task] > 1 and task not in self._lost:
            self._broken("done once", f"{robot} finishes {task}, which was finished before")

    def disk_lost(self, robot: str, hard_state: HardState | None) -> None:
        """Allow what a robot did to be done again: its disk is lost, and its reports with it."""
        self._lost_disks.append(hard_state)
        for task, finisher in self._finishers.items():
            if finisher == robot and not self._is_known_as_done(task):
                self.done[task] = 0

    def disk_given_up(self, hard_state: HardState) -> None:
        """Note what was on the disk of a member that begins anew to join another hive."""
        self._lost_disks.append(hard_state)

    def _is_known_as_done(self, task: str) -> bool:
        records = (
            hive.truth.get(task) or hive.forgotten.get(task) for hive in self._hives.values()
        )
        return any(record is not None and record.state.is_terminal for record in records)

    def _follow_commits(self, member: Member, before: Member | None) -> None:
        """Check that what a member holds as committed is what everyone else does."""
        hive = self._hives[member.hive]
        for known, record in hive.follow(member, before):
            if known is not None:
                self._check_left(known, record)
            elif record.task.id in hive.forgotten:
                self._begin_anew(record.task.id)
            if record.state is TaskState.DONE and record.task.id not in self._finished:
                what = f"{member.id} takes {record.task.id} for done, which nobody has finished"
                self._broken("done once", what)

    def _note_told(self, message: object) -> None:
        """Note of which tasks is told that they have ended."""
        if isinstance(message, TaskUpdate) and message.state.is_terminal:
            self._ended[message.task_id] += 1
        elif isinstance(message, TaskList):
            ended = (each.task.id for each in message.records if each.state.is_terminal)
            self._ended.update(ended)

    def _begin_anew(self, task: str) -> None:
        """Allow to be done what was posted under the id of a task that is forgotten."""
        self.done[task] = 0
        self._finished.discard(task)
        self._lost.discard(task)

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
        self._hives[member.hive].take_over(member)

    def _check_lease(self, host: Host, member: Member) -> None:
        self._leader_now.add(host.name)
        for name in tuple(self._leader_now - {host.name}):
            other = self._members[name]
            if other.backup is None or not other.host.up:
                self._leader_now.discard(name)
                continue
            if other.backup.hive != member.hive:
                continue
            now = self._now()
            if has_lease(member, now * host.rate) and has_lease(
                other.backup.member, now * other.host.rate
            ):
                self._broken(
                    "one authority", f"{name} and {host.name} may both act as the active one"
                )

    def _check_may_say(self, host: Host, topic: str) -> None:
        """Check that only an active one that a majority follows speaks as such."""
        backup = self._members[host.name].backup
        if backup is None:
            return
        member = backup.member
        if member.role is not Role.LEADER or not has_lease(member, self._now() * host.rate):
            self._broken(
                "one authority", f"{host.name} speaks on {topic} and no majority follows it"
            )

    def _check_is_safe(self, host: Host, task_id: str, assignment: int, what: str) -> None:
        """Check that a majority has on disk what is being told for the first time."""
        backup = self._members[host.name].backup
        if backup is None or (backup.hive, task_id, assignment, what) in self._told:
            return
        self._told.add((backup.hive, task_id, assignment, what))
        log = backup.member.log
        # While the list of members changes, it counts by the new one, and neither the old nor the
        # new one may elect anybody who does not hold it.
        lists = (log.stable.members, log.latest.members)
        disks = [member.disk.hard_state for member in self._members.values()]
        holders = set()
        for hard_state in (*disks, *self._lost_disks):
            record = hard_state.log.latest.records.get(task_id) if hard_state else None
            if hard_state and record and record.assignment >= assignment:
                holders.add(hard_state.member)
        held_by_enough = any(is_majority(holders, listed) for listed in lists)
        if held_by_enough and not any(may_elect_without(holders, listed) for listed in lists):
            return
        names = " or ".join(", ".join(map(name_of, listed)) for listed in dict.fromkeys(lists))
        self._broken(
            "nothing is lost",
            f"{host.name} tells {what} of {task_id}, which {len(holders)} hold; "
            f"the members are {names}",
        )

    def _broken(self, which: str, what: str) -> NoReturn:
        raise Violation(f"at {self._now():.3f} s: {which}: {what}")


def may_elect_without(holders: set[str], members: tuple[str, ...]) -> bool:
    """Return whether a majority of the members can be found among those that hold nothing."""
    return is_majority(set(members) - holders, members)
