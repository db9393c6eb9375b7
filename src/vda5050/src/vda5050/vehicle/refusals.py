# SPDX-License-Identifier: BSD-3-Clause
"""Why a vehicle refuses an order or an instant action, as typed errors of each version.

Source: VDA 5050 3.0, 6.1.4 "Order rejection" and 6.6.5.4 "Predefined error types"; up to 2.1, the
chapter "Order rejection", which knows fewer types.
"""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING

import attrs

from vda5050.protocol.state import Error, ErrorLevel, Reference
from vda5050.protocol.versions import Version

if TYPE_CHECKING:
    from vda5050.protocol.actions import Action
    from vda5050.protocol.order import Order


class Cause(enum.Enum):
    """Why something is refused: the type since 3.0, and the type before."""

    MALFORMED = ("VALIDATION_FAILURE", "validationError")
    PARAMETER = ("UNSUPPORTED_PARAMETER", "orderError")
    ACTION = ("INVALID_ORDER_ACTION", "orderError")
    OUTDATED = ("OUTDATED_ORDER_UPDATE", "orderUpdateError")
    SAME_UPDATE = ("SAME_ORDER_UPDATE_ID", "orderUpdateError")
    AFTER_CANCEL = ("ORDER_UPDATE_FOLLOWING_CANCEL", "orderUpdateError")
    NO_CONTINUATION = ("NO_ROUTE_TO_TARGET", "orderUpdateError")
    OTHER_ORDER = ("OTHER_ORDER_ACTIVE", "orderError")
    START_TOO_FAR = ("START_NODE_OUT_OF_RANGE", "noRouteError")
    NO_ROUTE = ("NO_ROUTE_TO_TARGET", "noRouteError")
    NOT_AVAILABLE = ("MOBILE_ROBOT_NOT_AVAILABLE", "orderError")
    UNKNOWN_MAP = ("UNKNOWN_MAP_ID", "orderError")
    NO_ORDER_TO_CANCEL = ("NO_ORDER_TO_CANCEL", "noOrderToCancel")
    INSTANT_ACTION = ("INVALID_INSTANT_ACTION", "instantActionError")
    UNREACHABLE = ("NODE_UNREACHABLE", "nodeUnreachable")
    NOT_HEEDED = ("EDGE_LIMIT_NOT_HEEDED", "edgeLimitNotHeeded")
    NOT_LOCALIZED = ("LOCALIZATION_ERROR", "localizationError")


_LEVELS = {
    Cause.PARAMETER: ErrorLevel.CRITICAL,
    Cause.UNREACHABLE: ErrorLevel.CRITICAL,
    Cause.NOT_LOCALIZED: ErrorLevel.FATAL,
}


@attrs.frozen
class Refusal:
    """One reason to refuse, with what a person needs to understand it."""

    cause: Cause
    text: str
    """The value found, what is allowed."""
    about: tuple[tuple[str, str], ...] = ()
    """Further references: kind of thing, and id."""

    def error(self, version: Version, about: tuple[tuple[str, str], ...]) -> Error:
        """Return the typed error of a version with references to what was refused."""
        since_3, before = self.cause.value
        return Error(
            error_type=since_3 if version is Version.V3_0 else before,
            error_level=_LEVELS.get(self.cause, ErrorLevel.WARNING),
            error_references=tuple(Reference(*each) for each in (*about, *self.about)),
            error_description=self.text,
        )


def about_order(order: Order) -> tuple[tuple[str, str], ...]:
    """Return the references to an order."""
    return (
        ("topic", "order"),
        ("orderId", order.order_id),
        ("orderUpdateId", str(order.order_update_id)),
    )


def about_instant_action(action: Action) -> tuple[tuple[str, str], ...]:
    """Return the references to an instant action."""
    return (
        ("topic", "instantActions"),
        ("actionId", action.action_id),
        ("actionType", action.action_type),
    )
