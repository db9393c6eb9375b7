# SPDX-License-Identifier: BSD-3-Clause
"""Gives each charger to one robot at a time, as a change of the task list.

A robot asks for a charger in its status. It drives there once its member's list shows the grant,
and only while it has its lease. So a grant ends like an assignment: by the robot's own word, or
when the robot is lost and has stopped. A lost robot that stands at its charger keeps it until the
hive has forgotten the robot. See docs/decisions/062.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.domain.characteristics import RobotState
from blackboard.domain.charger import Grant

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from blackboard.consensus.node import RaftNode
    from blackboard.domain.characteristics import RobotStatus


class ChargerGrants:
    """Answers what robots say about chargers, while its member leads."""

    def __init__(self, node: RaftNode) -> None:
        self._node = node

    def hear(self, status: RobotStatus) -> None:
        """Take back what a robot has given up, and give it what it asks for if that is free.

        A status that comes late, after the hive has answered a newer one, changes nothing.
        """
        wanted = Grant(status.charger, status.robot_id, status.charger_since, status.at_charger)
        mine = [each for each in self._node.grants.values() if each.robot == wanted.robot]
        if any(wanted.since < each.since for each in mine):
            return
        changes = [Grant(each.charger) for each in mine if each.charger != wanted.charger]
        given = self._node.grants.get(wanted.charger)
        is_free = given is None or given in mine
        if wanted.charger and is_free and given != wanted:
            changes.append(wanted)
        self._node.give_chargers(tuple(changes))

    def ask_for_room(self, fleet: Collection[RobotStatus]) -> None:
        """Ask as many robots to leave their chargers as other robots wait for one.

        These are the robots that have charged most of those that stand at chargers and would take
        tasks. One that a person has set to charge where it stands cannot be told from one that
        waits.
        """
        waiting = [each for each in fleet if self._waits(each)]
        idle = [each for each in fleet if each.state is RobotState.IDLE and each.at_charger]
        idle.sort(key=lambda each: (-each.charge, each.robot_id))
        self._node.ask_for_room(tuple(each.robot_id for each in idle[: len(waiting)]))

    def _waits(self, status: RobotStatus) -> bool:
        given = self._node.grants.get(status.charger)
        has_to = given is not None and given.robot != status.robot_id
        return status.state is RobotState.CHARGING and (has_to or not status.charger)

    def look(self, is_lost: Callable[[str], bool], is_gone: Callable[[str], bool]) -> None:
        """Take chargers from robots that are lost; from one that stands there, when it is gone."""
        free = (
            Grant(each.charger)
            for each in self._node.grants.values()
            if (is_gone(each.robot) if each.there else is_lost(each.robot))
        )
        self._node.give_chargers(tuple(free))
