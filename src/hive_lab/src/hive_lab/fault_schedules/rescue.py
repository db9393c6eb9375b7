# SPDX-License-Identifier: BSD-3-Clause
"""The operator who recovers a simulated hive whose majority is gone for good.

A person looks after the hive when all is calm: where no member leads and no majority is left, one
member goes on alone (`hive recover --force-members`). Then the person posts again what its list
lacks.
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
    from blackboard.domain.task import Task
    from hive_lab.fault_schedules.harness import Harness
    from hive_lab.fault_schedules.simulated_member import SimulatedMember

_EVERY = 15.0
"""Time between two looks; a hive says that it waits after 10 s [s]."""


class Rescuer:
    """Recovers one hive.

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
        harness.injector.faults["tasks posted again after a recovery"] += len(missing)
        for task_id in missing:
            if task_id in self._tasks:  # and no part of one
                self._post(task_id)

    def _post(self, task_id: str) -> None:
        """Post a task again until it is on the list: reports of robots are no answer to that."""
        harness = self._harness
        if not harness.checker.has_listed(task_id):
            harness.network.send(harness.operator, NEW_TASK, self._tasks[task_id])
            harness.network.schedule(REPEAT, None, self._post, task_id)


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
