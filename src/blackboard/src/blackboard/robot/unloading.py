# SPDX-License-Identifier: BSD-3-Clause
"""Puts a load down that nobody wants any more, where an operator says.

A robot whose task is cancelled while its load is on board leaves service with the load. An
operator can send it to a place; once the load is down there, the robot takes tasks again.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.domain.task import StepKind, Task, TaskType
from blackboard.robot.executor import CommandState

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.domain.record import Load
    from blackboard.domain.task import TaskStep
    from blackboard.robot.executor import CommandResult, Controller
    from blackboard.robot.lease_keeper import LeaseKeeper
    from blackboard.robot.loads import Loads
    from blackboard.robot.service import Service
    from hive_common.pose import Pose

_FIRST_STEP = 2
"""Of a GPAB: the drive to B, after A and the pick."""


class Unloading:
    """Brings the load that was left on board of one robot to a place, and puts it down.

    Args:
        service: Told when the load is down.
        loads: What is on board.
        controller: Drives, and lets the arm put the load down.
    """

    def __init__(self, service: Service, loads: Loads, controller: Controller) -> None:
        self._service = service
        self._loads = loads
        self._controller = controller
        self._load: Load | None = None

    def begin(self, place: Pose, lease: LeaseKeeper, changed: Callable[[], None]) -> str:
        """Bring the load to a place [map frame]; `changed` is called at the end.

        Returns:
            Why the robot cannot; empty if it goes.
        """
        loads = self._loads.others(())
        if self._service.left_on_board is None or not loads:
            return "no load was left on board; cancel its task first"
        if len(loads) > 1 or not self._service.is_sure:
            return "what is on board is not known; take it off, then put the robot back in service"
        if self._service.trouble:
            return self._service.trouble
        self.stop()
        (load,) = loads
        self._load = load
        task = Task(
            load.task_id, TaskType.GPAB, (place, place), payload=load.payload, posted=load.posted
        )
        self._service.about_load = f"brings the load of {load.task_id} to {place}"

        def ended(result: CommandResult) -> None:
            self._load = None
            if result.state is CommandState.SUCCEEDED:
                self._loads.end(task)
                self._service.unload()
            else:
                words = f"the load of {load.task_id} ({load.payload:g} kg) is still on board"
                self._service.about_load = f"{words}: {result.state.value}: {result.text}"
            changed()

        self._controller.run(task, _FIRST_STEP, lambda _step: None, ended, lease.holds)
        return ""

    def go_on(self) -> None:
        """Halt or resume, as the lease says now; a robot in trouble stops."""
        if self._service.trouble:
            self.stop()
        elif self._load is not None:
            self._controller.go_on()

    def stop(self) -> None:
        """Stop where the robot is; its load stays on board."""
        if self._load is not None:
            self._controller.stop()
            self._service.leave_on_board(self._load.task_id, self._load.payload)
            self._load = None

    def as_asked(self, number: int, step: TaskStep) -> TaskStep:
        """Return a step as the arm is asked for it: always with one id, looking first."""
        if self._load is None or step.kind is not StepKind.PLACE:
            return step
        return replace(step, action=f"{self._load.name}/{number}", look=True)
