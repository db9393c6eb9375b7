# SPDX-License-Identifier: BSD-3-Clause
"""Whether a robot's body can be reached, where it is not part of the robot's process.

An AGV that is cut off goes on with what it was told. Nobody else may have that before it is done;
from then on its robot is silent too, so that the hive treats it as any robot that is lost.
"""

from __future__ import annotations

from enum import Enum, auto
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from blackboard.domain.talker import Subscription, Talker, Topic


class Contact(Enum):
    """Whether a robot's body hears what the robot wants."""

    KEPT = auto()
    BROKEN = auto()  # it goes on with what it was told
    LOST = auto()  # by now it has done that, or never will


class Gate:
    """A talker that can be shut: nothing is said any more, and nothing heard.

    Args:
        talker: What it passes on to.

    Attributes:
        is_shut: Whether it is shut; its clocks and warnings go on.
    """

    def __init__(self, talker: Talker) -> None:
        self.is_shut = False
        self._talker = talker
        self.world, self.date = talker.world, talker.date
        self.watch = talker.watch
        self.now, self.every, self.after = talker.now, talker.every, talker.after
        self.warn, self.refuse = talker.warn, talker.refuse

    def publish(
        self,
        topic: Topic[Any],
        message: Any,  # noqa: ANN401  (a topic's)
        to: Collection[str] | None = None,
    ) -> None:
        """Publish unless it is shut."""
        if not self.is_shut:
            self._talker.publish(topic, message, to)

    def subscribe(
        self,
        topic: Topic[Any],
        handler: Callable[[Any], None],
        when: Callable[[], bool] | None = None,
    ) -> Subscription:
        """Listen while it is not shut."""
        return self._talker.subscribe(
            topic, handler, lambda: not self.is_shut and (when is None or when())
        )
