# SPDX-License-Identifier: BSD-3-Clause
"""The port of all communication (the report's Talker), and the names of the hive's topics.

The core reaches the world through a `Talker` only: messages, timers and the time itself. On ROS it
is `ros.talker.RosTalker`; in tests it is `testing.FakeNetwork`, whose time is virtual. A talker
calls back from one thread, one call after the other, so whoever uses it needs no lock.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

NEW_TASK = "new_task"
TASK_BROADCAST = "task_bc"
TASK_COST = "task_cost"
TASK_ASSIGN = "task_assign"
TASK_STATE = "task_state"
TASK_CANCEL = "task_cancel"
BACKUP = "bb_backup"
SYNC = "bb_sync"
BB_ENTRIES = "bb_entries"
BB_ACK = "bb_ack"
BB_VOTE = "bb_vote"
ROBOT_STATUS = "robot_status"
CHARGER_CLAIM = "charger_claim"
SET_STATE = "set_state"
"""In the robot's own namespace; all other topics belong to the hive."""


class Timer(Protocol):
    """A call that is going to happen."""

    def cancel(self) -> None:
        """Make it not happen; harmless when it already has."""


class Subscription(Protocol):
    """A topic that is listened to."""

    def cancel(self) -> None:
        """Hear nothing more of it."""


class Talker(Protocol):
    """How one member of the hive hears, speaks and knows the time."""

    def now(self) -> float:
        """Return the time [s] by which all timers run; its zero means nothing."""

    def publish(self, topic: str, message: object, to: Collection[str] | None = None) -> None:
        """Tell everyone who listens to a topic; the message is one of the core's values.

        Args:
            topic: On which.
            message: What is said.
            to: Names of the members, or of the robots, that it concerns; None where it concerns
                all. Other members need not be handed it. Whoever listens and is no member of a
                hive, as an operator's window, hears it in any case.
        """

    def subscribe(
        self,
        topic: str,
        handler: Callable[[Any], None],
        when: Callable[[], bool] | None = None,
    ) -> Subscription:
        """Have the messages of a topic handed over, this member's own included.

        Args:
            topic: Which.
            handler: Called with each of them.
            when: Asked before a message is read; what comes while it says no is dropped. All are
                handed over where it is left out.
        """

    def every(self, period: float, action: Callable[[], None]) -> Timer:
        """Call again and again, the first time after one period [s]."""

    def after(self, delay: float, action: Callable[[], None]) -> Timer:
        """Call once, after a delay [s]; 0 means as soon as what is going on now has ended."""

    def ping(self, member: str) -> bool:
        """Return whether a member's process answers; False is no proof that it is dead."""

    def watch(self, member: str, died: Callable[[], None]) -> None:
        """Call once when a member's process is proved dead, if that can be proved.

        Proof is that its connections are gone and its address refuses new ones; silence is none.
        Watching another member ends the watch on the one before.
        """

    def warn(self, text: str) -> None:
        """Tell the person who runs this member."""

    def refuse(self, topic: str, reason: str) -> None:
        """Note that a message of a topic was refused, and tell the person who runs this member.

        The same reason is told once, then with growing gaps, and counted; see `refusals`.
        """
