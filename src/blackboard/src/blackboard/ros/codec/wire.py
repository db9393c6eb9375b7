# SPDX-License-Identifier: BSD-3-Clause
"""How one topic's messages become core values, and core values messages."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable


@dataclass(frozen=True)
class Wire:
    """How one topic's messages are made and read.

    Attributes:
        message: The message class.
        to_msg: Makes a message of a core value.
        from_msg: Makes a core value of a message; raises ValueError where none can be made.
        latched: Whether newcomers get the last message.
    """

    message: type
    to_msg: Callable[[Any], Any]
    from_msg: Callable[[Any], Any]
    latched: bool = field(default=False)
