# SPDX-License-Identifier: BSD-3-Clause
"""Gives each charger to one robot at a time, as a change of the task list.

A robot asks for a charger in its status. It drives there once its member's list shows the grant,
and only while it has its lease. So a grant ends like an assignment: by the robot's own word, or
when the robot is lost and has stopped. A lost robot that stands at its charger keeps it until the
hive has forgotten the robot. See docs/decisions/062.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.consensus.node import RaftNode
    from blackboard.domain.characteristics import RobotStatus


class ChargerGrants:
    """Answers what robots say about chargers, while its member leads."""

    def __init__(self, node: RaftNode) -> None:
        self._node = node

    def hear(self, status: RobotStatus) -> None:
        """Take back what a robot has given up, and give it what it asks for if that is free.

        A status from before a grant, which comes late, does not give it up: it names a lower
        number. A robot that has not given up one charger yet gets no other.
        """
        robot, wanted = status.robot_id, status.charger
        mine = [each for each in self._node.grants.values() if each.robot == robot]
        kept = [each for each in mine if each.charger == wanted or status.grant < each.number]
        changes = {each.charger: "" for each in mine if each not in kept}
        given = self._node.grants.get(wanted)
        is_news = given is None or (
            given.robot == robot
            and given.there != status.at_charger
            and (status.at_charger or status.grant >= given.number)
        )
        if wanted and is_news and all(each.charger == wanted for each in kept):
            changes[wanted] = robot
        self._node.give_chargers(changes, {wanted} if status.at_charger else ())

    def look(self, is_lost: Callable[[str], bool], is_gone: Callable[[str], bool]) -> None:
        """Take chargers from robots that are lost; from one that stands there, when it is gone."""
        free = (
            each.charger
            for each in self._node.grants.values()
            if (is_gone(each.robot) if each.there else is_lost(each.robot))
        )
        self._node.give_chargers(dict.fromkeys(free, ""))
