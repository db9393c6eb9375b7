# SPDX-License-Identifier: BSD-3-Clause
"""Works through a robot's list from the top, as long as the robot may."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.domain.task import split_task

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.costing.schedule import Entry, Schedule
    from blackboard.robot.executor import CommandResult, Controller


class Worker:
    """Has the first task on the list done.

    Args:
        controller: Executes tasks.
        itinerary: The list.
        may_go: Says whether the next step of an entry may be begun or gone on with.
        on_start: Called with the entry when a task is begun.
        on_step: Called with the number of steps done, whenever one is.
        on_end: Called once with the last result of a task, unless it was stopped.
    """

    def __init__(
        self,
        controller: Controller,
        schedule: Schedule,
        may_go: Callable[[Entry], bool],
        on_start: Callable[[Entry], None],
        on_step: Callable[[int], None],
        on_end: Callable[[CommandResult], None],
    ) -> None:
        self._controller = controller
        self._list = schedule
        self._may_go = may_go
        self._on_start = on_start
        self._on_step = on_step
        self._on_end = on_end
        self._begun = False
        self._moving = False

    @property
    def current(self) -> Entry | None:
        """What has been begun and not ended; None when nothing has."""
        return self._list.first() if self._begun else None

    @property
    def stands_still(self) -> bool:
        """Whether there is work to do that may not be done now."""
        return self._list.first() is not None and not self._moving

    def go_on(self) -> None:
        """Begin, go on or halt, as the list and the leave to work stand now.

        A drive is halted at once. An arm finishes what it is doing, because nobody could tell what
        is in a gripper that was stopped half-way.
        """
        entry = self._list.first()
        if entry is None:
            return
        if not self._may_go(entry):
            if self._moving and self._controller.drives:
                self._controller.stop()
                self._moving = False
            return
        if not self._begun:
            self._begun = True
            self._on_start(entry)
        if not self._moving:
            self._moving = True
            self._controller.run(
                entry.task, entry.step, self._step_done, self._ended, self._may_try_again
            )

    def stop(self) -> None:
        """Stop what is under way; it is not gone on with."""
        self._controller.stop()
        self._begun = self._moving = False

    def _step_done(self, step: int) -> None:
        self._on_step(step)
        entry = self.current
        if entry is not None and step < len(split_task(entry.task)) and not self._may_go(entry):
            self._controller.stop()
            self._moving = False

    def _may_try_again(self) -> bool:
        """Return whether a step that has failed may be tried again now.

        The leave to work may have ended in the pause, and whoever was frozen learns of it late.
        """
        entry = self.current
        self._moving = entry is not None and self._may_go(entry)
        return self._moving

    def _ended(self, result: CommandResult) -> None:
        self._moving = False
        self._on_end(result)
