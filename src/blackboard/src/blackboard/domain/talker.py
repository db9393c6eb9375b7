# SPDX-License-Identifier: BSD-3-Clause
"""The port for all communication (the report's Talker), and the hive's topics.

The core reaches the world only through a `Talker`: messages, timers and the time itself. In a
process of the hive it is a `process.talker.MemberTalker`, in simulations one with virtual time. A
talker makes all its calls one after the other from one thread, so its users need no lock.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import Broadcast, Order, TaskUpdate
    from blackboard.domain.task import Task


_Message = TypeVar("_Message")


class Topic(str, Generic[_Message]):
    """The name of a topic, and for type checkers the type of its messages.

    The type is Any if it is defined in a package above `domain`.
    """

    __slots__ = ()


NEW_TASK: Topic[Task] = Topic("new_task")
TASK_BROADCAST: Topic[Broadcast] = Topic("task_bc")
TASK_COST: Topic[Any] = Topic("task_cost")
TASK_ASSIGN: Topic[Order] = Topic("task_assign")
TASK_STATE: Topic[TaskUpdate] = Topic("task_state")
TASK_CANCEL: Topic[str] = Topic("task_cancel")
BACKUP: Topic[Any] = Topic("bb_backup")
SYNC: Topic[Any] = Topic("bb_sync")
BB_ENTRIES: Topic[Any] = Topic("bb_entries")
BB_ACK: Topic[Any] = Topic("bb_ack")
BB_VOTE: Topic[Any] = Topic("bb_vote")
ROBOT_STATUS: Topic[RobotStatus] = Topic("robot_status")
SET_STATE: Topic[str] = Topic("set_state")
"""In the robot's own namespace; all other topics belong to the hive."""

URGENT = frozenset({BACKUP, BB_ACK, BB_VOTE, BB_ENTRIES, TASK_ASSIGN})
"""Topics on which a message overtakes those of others, on its way and where it waits to be read: a
hive elects another leader if the leader and a majority do not hear each other in time."""

LEARNER_TOPICS = (TASK_STATE, ROBOT_STATUS, BB_ACK)
"""What a member that cannot lead may publish."""

VOTER_TOPICS = (
    *LEARNER_TOPICS,
    NEW_TASK,
    TASK_BROADCAST,
    TASK_ASSIGN,
    BACKUP,
    SYNC,
    BB_ENTRIES,
    BB_VOTE,
)
"""What a member that can lead may publish; it advertises all of it before it has to."""

ROBOT_TOPICS = (TASK_COST,)
"""What a robot may publish besides."""


class Timer(Protocol):
    """A call that is scheduled."""

    def cancel(self) -> None:
        """Prevent it; harmless if it has already happened."""


class Subscription(Protocol):
    """A subscribed topic."""

    def cancel(self) -> None:
        """Stop listening."""


class Clock(Protocol):
    """A time and its timers."""

    def now(self) -> float:
        """Return the time that the timers use [s]; its zero means nothing."""

    def every(self, period: float, action: Callable[[], None]) -> Timer:
        """Call repeatedly, the first time after one period [s]."""

    def after(self, delay: float, action: Callable[[], None]) -> Timer:
        """Call once after a delay [s]; 0 means as soon as the present call has returned."""


class Talker(Clock, Protocol):
    """Messages between the members of the hive, and the clock that leases and elections use.

    That clock is the machine's own: it goes on while a simulation is paused, and no faster in a
    fast one (docs/decisions/022).
    """

    @property
    def world(self) -> Clock:
        """The clock of what robots do; simulated time in a simulation."""

    def date(self) -> float:
        """Return the time that messages state, such as `Task.posted` [s].

        Outside a simulation it is the date, which a person may set. Compare it with such times
        only; it has no timers.
        """

    def publish(
        self, topic: Topic[_Message], message: _Message, to: Collection[str] | None = None
    ) -> None:
        """Send a value of the core to everyone who listens to a topic.

        `to` names the members or robots that need it; None means all. The talker need not deliver
        it to other members. Listeners that are not members, such as an operator's window, get it
        in any case.
        """

    def subscribe(
        self,
        topic: Topic[_Message],
        handler: Callable[[_Message], None],
        when: Callable[[], bool] | None = None,
    ) -> Subscription:
        """Listen to a topic; messages of this member itself arrive too.

        `when` is asked before a message is read; while it returns False, messages are dropped.
        """

    def watch(self, member: str, died: Callable[[], None]) -> None:
        """Call once when a member's process is proved dead, if that can be proved.

        Proof is that its connections are gone and its address refuses new ones; silence is none.
        Watching another member ends the previous watch.
        """

    def warn(self, text: str) -> None:
        """Tell the person who runs this member."""

    def refuse(self, topic: str, reason: str) -> None:
        """Count a message that was refused, and tell the person who runs this member.

        The same reason is logged once, then at growing intervals; see `board.refusals`.
        """
