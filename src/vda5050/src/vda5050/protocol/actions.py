# SPDX-License-Identifier: BSD-3-Clause
"""Actions: what an AGV is asked to do on a node, on an edge or at once, and how far it is."""

import enum
from typing import Annotated, Any

import attrs

from vda5050.protocol.rules import Text, each

CANCEL_ORDER = "cancelOrder"
START_PAUSE = "startPause"
STOP_PAUSE = "stopPause"
STATE_REQUEST = "stateRequest"
INIT_POSITION = "initPosition"
FACTSHEET_REQUEST = "factsheetRequest"
START_CHARGING = "startCharging"
STOP_CHARGING = "stopCharging"
PICK = "pick"
DROP = "drop"


class BlockingType(enum.Enum):
    """What an AGV must not do while it does an action."""

    NONE = "NONE"
    """It may drive and do other actions."""
    SINGLE = "SINGLE"
    """It may drive, but do no other action."""
    SOFT = "SOFT"
    """It may do other actions, but not drive."""
    HARD = "HARD"
    """It may do nothing else."""


class ActionStatus(enum.Enum):
    """How far an action is."""

    WAITING = "WAITING"
    INITIALIZING = "INITIALIZING"
    RUNNING = "RUNNING"
    PAUSED = "PAUSED"
    RETRIABLE = "RETRIABLE"
    """Failed, but may be tried again; since 3.0."""
    FINISHED = "FINISHED"
    """Terminal."""
    FAILED = "FAILED"
    """Terminal."""

    @property
    def ended(self) -> bool:
        """Whether nothing will change any more."""
        return self in {ActionStatus.FINISHED, ActionStatus.FAILED}


@attrs.frozen
class ActionParameter:
    """One parameter of an action."""

    key: Annotated[str, Text]
    value: Any
    """A text, number, boolean, list or object."""


@attrs.frozen
class Action:
    """One thing to do."""

    action_type: Annotated[str, Text]
    """The standard's name of what to do, or the maker's."""
    action_id: Annotated[str, Text]
    """Unique among the actions of this AGV."""
    blocking_type: BlockingType
    action_parameters: tuple[ActionParameter, ...] | None = None
    action_descriptor: str | None = None
    retriable: bool | None = None

    def parameter(self, key: str, default: Any = None) -> Any:  # noqa: ANN401  (any JSON)
        """Return the value of a parameter, or `default` if the action has none of this name."""
        return next((p.value for p in self.action_parameters or () if p.key == key), default)


@attrs.frozen
class ActionState:
    """How far an action of the order, or an instant action, is."""

    action_id: Annotated[str, Text]
    action_status: ActionStatus
    action_type: str | None = None
    action_descriptor: str | None = None
    action_result: str | None = None


@attrs.frozen
class InstantActions:
    """Topic `instantActions`: actions that are no part of an order."""

    actions: tuple[Action, ...] = each()
