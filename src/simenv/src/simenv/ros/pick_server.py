# SPDX-License-Identifier: BSD-3-Clause
"""A robot's arm as an action server."""

from __future__ import annotations

from typing import TYPE_CHECKING

import actionlib
from blackboard.msg import PickAction, PickFeedback, PickResult

from hive_common.ros import action_servers
from simenv.bodies.pick import Act, Order, PickOutcome
from simenv.errors import CommandError

if TYPE_CHECKING:
    from hive_common.ros.inbox import Inbox
    from simenv.simulation import Simulation


class PickServer:
    """Passes the orders of action clients to a robot's arm; a new order replaces the old one.

    A goal that asks for the order under way again takes the place of the goal before, and the arm
    goes on: so a robot's process that ends and comes back gets the result.

    ROS Actions:
        <robot>/pick (blackboard/PickAction): SUCCEEDED, ABORTED with the reason in the result, or
            PREEMPTED when cancelled or replaced. Feedback gives the progress at 5 Hz.
    """

    def __init__(self, name: str, simulation: Simulation, inbox: Inbox) -> None:
        """Serve the arm of the robot `name`."""
        self._name = name
        self._simulation = simulation
        self._arm = simulation.arm(name)
        self._goal: actionlib.ServerGoalHandle | None = None
        self._server = actionlib.ActionServer(
            f"{name}/pick",
            PickAction,
            goal_cb=lambda goal: inbox.put(lambda: self._begin(goal)),
            cancel_cb=lambda goal: inbox.put(lambda: self._cancel(goal)),
            auto_start=False,
        )
        action_servers.start(self._server)

    def stop(self) -> None:
        """Stop serving."""
        self._drop("the robot was removed from the simulation")
        self._server.stop()

    def _begin(self, goal: actionlib.ServerGoalHandle) -> None:
        order = goal.get_goal()
        try:
            wanted = Order(
                Act(order.act),
                order.task_id,
                order.payload,
                order.action_id,
                order.look,
                order.posted.to_sec(),
            )
            if self._arm.is_at(wanted):
                self._take_over(goal)
                return
            self._drop("a newer order came in")
            self._arm.start(wanted, self._simulation.poses[self._name])
        except (CommandError, ValueError) as error:
            self._drop("a newer order came in")
            goal.set_rejected(text=f"{self._name}: {error}; see blackboard/Pick.action")
            return
        goal.set_accepted()
        self._goal = goal
        self.report()

    def _take_over(self, goal: actionlib.ServerGoalHandle) -> None:
        """Report on the order under way to a newer goal that asks for the same."""
        if self._goal is not None:
            self._goal.set_canceled(text=f"{self._name}: asked for again")
        goal.set_accepted()
        self._goal = goal

    def _cancel(self, goal: actionlib.ServerGoalHandle) -> None:
        if self._goal is not None and goal == self._goal:
            self._drop("cancelled")

    def _drop(self, reason: str) -> None:
        if self._goal is not None:
            self._arm.cancel()
            self._goal.set_canceled(text=f"{self._name}: {reason}")
            self._goal = None

    def report(self) -> None:
        """Send the client the result once the order has ended."""
        result = self._arm.result
        if self._goal is None or result is None:
            return
        message = PickResult(outcome=int(result.outcome), message=result.message)
        if result.outcome is PickOutcome.SUCCESS:
            self._goal.set_succeeded(message, result.message)
        else:
            self._goal.set_aborted(message, result.message)
        self._goal = None

    def feed_back(self) -> None:
        """Send the client the progress of the order."""
        if self._goal is not None:
            self._goal.publish_feedback(PickFeedback(progress=self._arm.progress))
