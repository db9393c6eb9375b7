# SPDX-License-Identifier: BSD-3-Clause
"""Properties of the protocol that must always hold, checked after every event.

docs/protocol.md explains them. The checker sees every disk, every message as it is sent, and every
robot's wheels. A broken property ends the run with a `Violation` that names it.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import TYPE_CHECKING, NoReturn

from blackboard.consensus.member import Role, has_lease, is_majority, name_of
from blackboard.consensus.task_list import TaskList
from blackboard.domain.record import Order, OrderKind, TaskRecord, TaskUpdate
from blackboard.domain.talker import BACKUP, TASK_ASSIGN, TASK_BROADCAST, TASK_STATE
from blackboard.domain.task import StepKind, TaskState, TaskType, split_task
from hive_lab.fault_schedules.charger_checker import ChargerChecker
from hive_lab.fault_schedules.ending import Ending
from hive_lab.fault_schedules.history import History, Violation
from hive_lab.fault_schedules.simulated_arm import LoadChecker
from hive_lab.virtual.task_checker import is_taken_away

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from blackboard.consensus.journal import HardState
    from blackboard.consensus.member import Member
    from blackboard.domain.task import Task, TaskStep
    from hive_lab.fault_schedules.faulty_network import Host
    from hive_lab.fault_schedules.features.exercised import Exercised
    from hive_lab.fault_schedules.simulated_member import SimulatedMember


class ProtocolChecker:
    """Watches one hive.

    Args:
        members: All members, by name.
        tasks: All tasks that will be posted.
        now: Returns the true time [s].
        exercised: Counts what the hive does.

    Attributes:
        done: How often a robot has really finished each task.
        loads: Follows what arms pick and put down.
        chargers: Follows who drives to a charger.
    """

    def __init__(
        self,
        members: Mapping[str, SimulatedMember],
        tasks: Iterable[Task],
        now: Callable[[], float],
        exercised: Exercised,
    ) -> None:
        self._members = members
        self._exercised = exercised
        self._last_steps = {task.id: split_task(task)[-1] for task in tasks}
        self._now = now
        self._seen: dict[str, Member] = {}
        self._leader_now: set[str] = set()
        self._ended: Counter[str] = Counter()
        self._hives: dict[str, History] = defaultdict(lambda: History(self._broken, self._ended))
        self._lost_disks: list[HardState | None] = []
        self._told: set[tuple[str, str, int, str]] = set()
        self._workers: dict[str, dict[str, TaskStep]] = defaultdict(dict)
        self._finishers: dict[str, str] = {}
        self._finished: set[str] = set()
        self._handed_back: set[tuple[str, str, int]] = set()
        self._lost: set[str] = set()
        self.loads = LoadChecker(self._broken)
        self.chargers = ChargerChecker(members, self._broken)
        self.ending = Ending(members, self._hives, self._last_steps, self._broken)
        self.takeovers = 0
        self.done: Counter[str] = Counter()

    def after_event(self, host: Host) -> None:
        """Check everything that an event on a host may have changed."""
        own = self._members.get(host.name)
        if own is None:
            return  # the operator
        node = own.node
        if node is None or not host.up:
            self._leader_now.discard(host.name)
            self._seen.pop(host.name, None)
            return
        member = node.member
        before = self._seen.get(host.name)
        if member is before:
            return
        self._seen[host.name] = member
        if before is None or member.log is not before.log:
            self._follow_commits(member, before)
            self.chargers.listed(member.log.stable.grants)
        if member.role is Role.LEADER:
            if before is not None and member.log.stable.members != before.log.stable.members:
                self._exercised.changed_members()
            if before is None or before.role is not Role.LEADER:
                self._check_takeover(member)
            self._check_lease(host, member)
        else:
            self._leader_now.discard(host.name)

    def said(self, host: Host, topic: str, message: object) -> None:
        """Check a message that a host is about to send."""
        if topic in {BACKUP, TASK_BROADCAST, TASK_ASSIGN}:
            self._check_may_say(host, topic)
        self._exercised.said(message)
        self._note_told(message)
        if topic == TASK_STATE and isinstance(message, TaskUpdate):
            if message.robot_id and message.state is TaskState.WAITING:
                report = message.task_id, message.robot_id, message.assignment
                self._handed_back.add(report)
            by_blackboard = not message.robot_id or message.state is TaskState.ASSIGNED
            if by_blackboard and message.state in {TaskState.WAITING, TaskState.ASSIGNED}:
                self._check_is_safe(host, message.task_id, message.assignment, message.state.name)
        elif (
            topic == TASK_ASSIGN
            and isinstance(message, Order)
            and message.kind is OrderKind.ASSIGN
        ):
            self._check_is_safe(host, message.task.id, message.assignment, "an order")

    def at_work(self, robot: str, step: TaskStep, works: bool) -> None:
        """Record that a robot begins or stops working on a step of a task."""
        task = step.task_id
        if not works:
            self._workers[task].pop(robot, None)
            return
        self._workers[task][robot] = step
        workers = self._workers_on(task)
        if len(workers) > 1:
            self._broken("never two robots", f"{' and '.join(sorted(workers))} work on {task}")
        for other in tuple(self._workers):
            is_part = other.startswith(f"{task}.") or task.startswith(f"{other}.")
            if is_part and (others := self._workers_on(other)):
                at_both = ", ".join(sorted(others | workers))
                what = f"{at_both} work on {task} and {other}, of which one is a part of the other"
                self._broken("never two robots", what)

    def stopped(self, robot: str) -> None:
        """Record the end of a robot's process, which stops its wheels."""
        for workers in self._workers.values():
            workers.pop(robot, None)

    def _workers_on(self, task: str) -> set[str]:
        """Return who works on a task, except arms that end a step of an earlier one of that id."""
        steps = self._workers[task].items()
        return {robot for robot, step in steps if not self.loads.is_of_an_earlier_task(step)}

    def step_done(self, robot: str, step: TaskStep) -> None:
        """Record a completed step."""
        task = step.task_id
        if step != self._last_step(task):
            return
        if step.kind is StepKind.PICK:
            # A person is there and takes the load of a GPA off.
            self.loads.arms[robot].take_off()
        if self.loads.is_of_an_earlier_task(step):
            return
        self.done[task] += 1
        self._finished.add(task)
        self._finishers[task] = robot
        if self.done[task] > 1 and task not in self._lost:
            self._broken("done once", f"{robot} finishes {task} again")

    def _last_step(self, task: str) -> TaskStep | None:
        """Return the last step of a task that was posted, or that is a part of one."""
        if task in self._last_steps:
            return self._last_steps[task]
        listed = (hive.truth.get(task) for hive in self._hives.values())
        return next((split_task(record.task)[-1] for record in listed if record), None)

    def disk_lost(self, robot: str, hard_state: HardState | None) -> None:
        """Allow a robot's tasks to be done again: its disk is lost, and its reports with it."""
        self._lost_disks.append(hard_state)
        self.reports_lost(robot)

    def reports_lost(self, robot: str) -> None:
        """Allow a robot's tasks to be done again of whose end neither it nor the hive knows."""
        for task, finisher in self._finishers.items():
            if finisher == robot and not self._is_known_as_done(task):
                self.done[task] = 0

    def disk_given_up(self, hard_state: HardState) -> None:
        """Record the disk of a member that starts anew to join another hive."""
        self._lost_disks.append(hard_state)

    def has_listed(self, task: str) -> bool:
        """Return whether the hive that most members belong to has had a task on its list."""
        hive = self._hives[self.ending.greatest()]
        return task in hive.truth or task in hive.forgotten

    def recovered(self, before: HardState, after: HardState) -> Sequence[str]:
        """Follow the hive as which a person recovers one whose majority is gone.

        What only the lost members had on disk is lost, so it may be done again. Returns the tasks
        that the list no longer has, and whose end the hive did not know.
        """
        old, new = self._hives[before.hive], self._hives[after.hive]
        new.go_on_from(after.log, old)
        listed = after.log.latest.records
        behind = {task for task, record in old.truth.items() if listed.get(task) != record}
        behind |= old.forgotten.keys() & listed.keys()
        self._lost |= behind
        self.loads.unclear |= behind
        return sorted(behind - listed.keys() - new.forgotten.keys())

    def hive_ended(self, hive: str) -> Sequence[str]:
        """Allow the open tasks of a hive to be done again that a person has ended; return them."""
        records = self._hives[hive].truth.items()
        left = [task for task, record in records if not record.state.is_terminal]
        self._lost.update(left)
        self.loads.unclear.update(left)
        return left

    def _is_known_as_done(self, task: str) -> bool:
        records = (
            hive.truth.get(task) or hive.forgotten.get(task) for hive in self._hives.values()
        )
        return any(record is not None and record.state.is_terminal for record in records)

    def _follow_commits(self, member: Member, before: Member | None) -> None:
        """Check a member's newly committed entries."""
        hive = self._hives[member.hive]
        for known, record in hive.follow(member, before):
            anew = known is None and record.task.id in hive.forgotten
            self._exercised.committed(known, record, anew=anew)
            if known is not None:
                self._check_left(known, record)
            elif anew:
                self._begin_anew(record, member.hive)
            done = record.state is TaskState.DONE and not record.parts
            if done and record.task.type == TaskType.GPAB:
                self.loads.check_done(record.task.id, member.hive, record.assignment)
            if done and record.task.id not in self._finished:
                what = f"{member.id} commits {record.task.id} as done, which nobody has finished"
                self._broken("done once", what)

        for part in hive.joined:
            self._check_joined(part)
        hive.joined.clear()

    def _check_joined(self, part: TaskRecord) -> None:
        """Check that a part which becomes part of a whole again was neither begun nor done."""
        name = part.task.id
        if name in self._finished:
            self._broken("done once", f"{name} is done, and its whole is to be done again")
        if robots := self._workers_on(name):
            what = f"{name} is joined while {', '.join(sorted(robots))} works on it"
            self._broken("never two robots", what)

    def _note_told(self, message: object) -> None:
        """Record which tasks were published as ended."""
        if isinstance(message, TaskUpdate) and message.state.is_terminal:
            self._ended[message.task_id] += 1
        elif isinstance(message, TaskList):
            ended = (each.task.id for each in message.records if each.state.is_terminal)
            self._ended.update(ended)

    def _begin_anew(self, record: TaskRecord, hive: str) -> None:
        """Allow a task to be done that was posted under the id of a forgotten one."""
        task = record.task.id
        self.done[task] = 0
        self._finished.discard(task)
        self._lost.discard(task)
        self.loads.begin_anew(task, hive, record.earlier)

    def _check_left(self, before: TaskRecord, after: TaskRecord) -> None:
        """Check that a robot has stopped before its task is taken from it without a handback.

        Another robot may then do the task again: `on_robot_lost` is `reassign` here.
        """
        name, robot = before.task.id, before.robot
        if not before.is_held or not is_taken_away(before, after, self._handed_back):
            return
        self._lost.add(name)
        if robot in self._workers_on(name):
            self._broken("never two robots", f"{name} is taken from {robot}, which works on it")

    def _check_takeover(self, member: Member) -> None:
        self.takeovers += 1
        hive = self._hives[member.hive]
        hive.take_over(member)
        disks = [each.disk.hard_state for each in self._members.values()]
        self._exercised.took_over(member, hive.applied, disks)

    def _check_lease(self, host: Host, member: Member) -> None:
        self._leader_now.add(host.name)
        for name in tuple(self._leader_now - {host.name}):
            other = self._members[name]
            if other.node is None or not other.host.up:
                self._leader_now.discard(name)
                continue
            if other.node.hive != member.hive:
                continue
            now = self._now()
            if has_lease(member, now * host.rate) and has_lease(
                other.node.member, now * other.host.rate
            ):
                self._broken("one authority", f"{name} and {host.name} may both act as leader")

    def _check_may_say(self, host: Host, topic: str) -> None:
        """Check that only a leader with a majority speaks as leader."""
        node = self._members[host.name].node
        if node is None:
            return
        member = node.member
        if member.role is not Role.LEADER or not has_lease(member, self._now() * host.rate):
            self._broken("one authority", f"{host.name} speaks on {topic} without a majority")

    def _check_is_safe(self, host: Host, task_id: str, assignment: int, what: str) -> None:
        """Check that a majority has on disk what is published for the first time."""
        node = self._members[host.name].node
        if node is None or (node.hive, task_id, assignment, what) in self._told:
            return
        self._told.add((node.hive, task_id, assignment, what))
        log = node.member.log
        # During a membership change the new list counts, and neither list may elect a member
        # without the entry.
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
            f"{host.name} publishes {what} of {task_id}, which {len(holders)} hold; "
            f"the members are {names}",
        )

    def _broken(self, which: str, what: str) -> NoReturn:
        raise Violation(f"at {self._now():.3f} s: {which}: {what}")


def may_elect_without(holders: set[str], members: tuple[str, ...]) -> bool:
    """Return whether the members without it form a majority."""
    return is_majority(set(members) - holders, members)
