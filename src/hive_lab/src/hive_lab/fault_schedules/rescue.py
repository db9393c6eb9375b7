# SPDX-License-Identifier: BSD-3-Clause
"""The person who looks after a simulated hive when all is calm, and does what the log says.

Where no member leads and no majority is left, one member goes on alone (`hive recover
--force-members`). Where a second hive waits for a person, its members are ended and start again
without their journals. Then the person posts again what the list lacks.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.consensus.member import Role, is_majority
from blackboard.consensus.recovery import newest, recovered
from blackboard.domain.talker import NEW_TASK
from hive_lab.fault_schedules.harness import REPEAT

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from blackboard.consensus.journal import HardState
    from blackboard.consensus.member import Member
    from blackboard.domain.task import Task
    from hive_lab.fault_schedules.harness import Harness
    from hive_lab.fault_schedules.simulated_member import SimulatedMember

_EVERY = 15.0
"""Time between two looks; a hive says that it waits after 10 s [s]."""


class Rescuer:
    """Recovers one hive, or ends another one beside it.

    Args:
        harness: The hive, and everything that watches it.
        tasks: What operators have posted, by id.
    """

    def __init__(self, harness: Harness, tasks: Mapping[str, Task]) -> None:
        self._harness = harness
        self._tasks = tasks

    def watch(self, _: object = None) -> None:
        """Recover the hive if it cannot go on, and look again later."""
        if (state := hopeless(self._harness.members)) is not None:
            self.recover(state)
        self._harness.network.schedule(_EVERY, None, self.watch, None)

    def end_other_hives(self, waited: frozenset[tuple[str, str]] = frozenset()) -> None:
        """Move away the journals of members that wait for a person, and look again later.

        Args:
            waited: The members that waited at the look before, and the hive of each.
        """
        waiting = _waiting_for_a_person(self._harness.members.values())
        for name, hive in sorted(waited & waiting):
            self._harness.injector.faults["journals moved away"] += 1
            self._harness.injector.move_journal_away(name)
            if hive not in {each for _, each in waiting - waited}:
                self._post_again(self._harness.checker.hive_ended(hive))
        self._harness.network.schedule(_EVERY, None, self.end_other_hives, waiting - waited)

    def recover_with(self, name: str) -> None:
        """Have a member go on alone, whatever has become of the others.

        Without a name it is the newest, if the hive cannot go on.
        """
        members = self._harness.members
        state = members[name].disk.hard_state if name else hopeless(members)
        if state is not None and state.hive:
            self.recover(state)

    def recover(self, state: HardState) -> None:
        """Have the member with a state on its disk go on alone."""
        harness = self._harness
        harness.injector.faults["recoveries"] += 1
        member = next(m for m in harness.members.values() if m.disk.hard_state is state)
        harness.injector.restart(member.name)
        member.voter = True  # `stands_by`: where only learners are left, one has to lead
        after = recovered(state, harness.random)
        member.disk.hard_state = after
        missing = harness.checker.recovered(state, after)
        self._post_again(missing)

    def _post_again(self, missing: Iterable[str]) -> None:
        for task_id in missing:
            if task_id in self._tasks:  # and no part of one
                self._harness.injector.faults["tasks posted again by a person"] += 1
                self._post(task_id)

    def _post(self, task_id: str) -> None:
        """Post a task again until it is on the list: reports of robots are no answer to that."""
        harness = self._harness
        if not harness.checker.has_listed(task_id):
            harness.network.send(harness.operator, NEW_TASK, self._tasks[task_id])
            harness.network.schedule(REPEAT, None, self._post, task_id)


def _waiting_for_a_person(members: Iterable[SimulatedMember]) -> frozenset[tuple[str, str]]:
    """Return the members of hives that wait beside the only one with a leader; see `Rescuer`.

    A member joins that hive by itself if it has no vote, or if it is the only member of its hive
    and no robot has a task of that.
    """
    states = {each.name: each.node.member for each in members if each.host.up and each.node}
    led = {member.hive for member in states.values() if member.role is Role.LEADER}
    if len(led) != 1:
        return frozenset()
    others = {name: each for name, each in states.items() if each.hive and each.hive not in led}
    return frozenset((name, each.hive) for name, each in others.items() if _may_not_leave(each))


def _may_not_leave(member: Member) -> bool:
    at_work = any(record.is_held for record in member.log.latest.records.values())
    return member.id in member.members and (len(member.members) > 1 or at_work)


def hopeless(members: Mapping[str, SimulatedMember]) -> HardState | None:
    """Return the newest disk of a hive without a leader of which no majority is left.

    None if some member leads, or one may still be elected.
    """
    left = [each for each in members.values() if not each.gone]
    running = [each for each in left if each.host.up]
    if any(each.node and each.node.member.role is Role.LEADER for each in running):
        return None
    disks = _disks([each for each in running if each.voter] or running)
    if not disks or any(_may_be_elected(disk, _disks(left)) for disk in _disks(left)):
        return None
    return newest(disks)


def _disks(members: Iterable[SimulatedMember]) -> list[HardState]:
    """Return what is on the disks of members that belong to a hive."""
    states = [each.disk.hard_state for each in members]
    return [state for state in states if state is not None and state.hive]


def _may_be_elected(disk: HardState, others: Sequence[HardState]) -> bool:
    """Return whether enough of the members on a member's list run and lack what it has."""
    voters = [each.member for each in others if each.log.position <= disk.log.position]
    return is_majority(voters, disk.log.latest.members)
