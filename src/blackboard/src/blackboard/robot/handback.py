# SPDX-License-Identifier: BSD-3-Clause
"""How a robot lets go of a task: dropped for good, or handed back with a report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.domain.task import TaskState, is_picked

if TYPE_CHECKING:
    from blackboard.costing.schedule import Entry, Schedule
    from blackboard.robot.reports import Reports
    from blackboard.robot.service import Service
    from blackboard.robot.worker import Worker
    from hive_common.pose import Pose


class Handback:
    """Takes tasks off a robot's list; a load that its arm has on board takes it out of service.

    Args:
        work: What is under way.
        itinerary: The list.
        service: Told of a load that is left on board.
        reports: What the blackboard is told.
    """

    def __init__(
        self, work: Worker, schedule: Schedule, service: Service, reports: Reports
    ) -> None:
        self._work = work
        self._list = schedule
        self._service = service
        self._reports = reports

    def drop(self, entry: Entry) -> bool:
        """Take a task off the list and stop it; return whether its load is on board."""
        if entry is self._work.current:
            self._work.stop()
        loaded = is_picked(entry.task, entry.step)
        if loaded:
            self._service.leave_on_board(entry.task.id, entry.task.payload)
        self._list.remove(entry.task.id)
        return loaded

    def hand_back(self, entry: Entry, reason: str, here: Pose, put_off_for: str = "") -> None:
        """Give a task back to the blackboard; one whose load is on board needs a person.

        Args:
            entry: The task.
            reason: Why, in words.
            here: Where the robot stands.
            put_off_for: Id of the more urgent task that it makes room for.
        """
        loaded = self.drop(entry)
        if loaded:
            weight = f"{entry.task.payload:g} kg"
            reason += f"; its load of {weight} is on board at {here}: take it off"
        state = TaskState.FAILED if loaded else TaskState.WAITING
        self._reports.add(entry.update(state, reason=reason, put_off_for=put_off_for))
