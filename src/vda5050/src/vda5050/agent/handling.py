# SPDX-License-Identifier: BSD-3-Clause
"""One pick or drop of an AGV: an order of one node with one action.

The load has the task's id as its name. So an agent that was restarted sees whether the AGV has the
load already, or is about to take it, and does not ask for it twice.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import attrs

from blackboard.domain.task import StepKind
from blackboard.robot.executor import CommandResult, CommandState
from vda5050.agent.order_keeper import Phase
from vda5050.protocol.actions import Action, ActionParameter, ActionStatus, BlockingType

if TYPE_CHECKING:
    from blackboard.domain.task import TaskStep
    from vda5050.agent.maker import Actions
    from vda5050.agent.order_keeper import OrderKeeper
    from vda5050.agent.order_parts import Stop
    from vda5050.protocol.actions import ActionState
    from vda5050.protocol.state import State


class Handling:
    """One pick or drop, from its order to its end.

    Args:
        step: What to do.
        actions: What the maker calls it.
        keeper: Of the AGV's order.
    """

    def __init__(self, step: TaskStep, actions: Actions, keeper: OrderKeeper) -> None:
        self._step = step
        self._picks = step.kind is StepKind.PICK
        self._action = actions.pick if self._picks else actions.drop
        self._keeper = keeper
        self._begun = False

    def pass_time(self, now: float, state: State, here: Stop) -> CommandResult | None:
        """Go on; return how it ended, once it has.

        Args:
            now: The time [s].
            state: What the AGV told last.
            here: Where it stands.
        """
        keeper = self._keeper
        if self._begun:
            return self._result()
        if self._is_done(state):
            return CommandResult(CommandState.SUCCEEDED, "it was done already")
        if self._earlier(state) is not None:
            return None  # the AGV is about it, for an earlier process of the agent
        if keeper.foreign:
            keeper.cancel(now)
        elif keeper.phase is Phase.IDLE:
            keeper.begin([attrs.evolve(here, actions=(self._order(),))], 1, now)
            self._begun = True
        return None

    def _result(self) -> CommandResult | None:
        keeper = self._keeper
        if keeper.failure:
            failure, keeper.failure = keeper.failure, ""
            return CommandResult(CommandState.ABORTED, failure)
        return CommandResult(CommandState.SUCCEEDED) if keeper.completed else None

    def _is_done(self, state: State) -> bool:
        """Return whether the load is where it is to be, as far as the AGV knows its loads."""
        if state.loads is None or not self._action.load_id:
            earlier = self._find(state)
            return earlier is not None and earlier.action_status is ActionStatus.FINISHED
        on_board = {load.load_id for load in state.loads}
        if self._picks:
            return self._step.task_id in on_board
        earlier = self._find(state)
        dropped = earlier is not None and earlier.action_status is ActionStatus.FINISHED
        return dropped and self._step.task_id not in on_board

    def _earlier(self, state: State) -> ActionState | None:
        found = self._find(state)
        return None if found is None or found.action_status.ended else found

    def _find(self, state: State) -> ActionState | None:
        """Return the same action of an order that this process did not give."""
        if not self._keeper.is_strange(state.order_id):
            return None
        own = (each for each in state.action_states if each.action_id.startswith(self._prefix))
        return max(own, key=lambda each: each.action_id, default=None)

    @property
    def _prefix(self) -> str:
        return f"{self._step.task_id}.{self._step.kind.name.lower()}."

    def _order(self) -> Action:
        action, step = self._action, self._step
        given = dict(action.parameters)
        if action.load_id:
            given[action.load_id] = step.task_id
        if action.load_mass:
            given[action.load_mass] = step.payload
        return Action(
            action.type,
            self._prefix + self._keeper.next_id(),
            BlockingType.HARD,
            tuple(ActionParameter(key, value) for key, value in given.items()),
        )
