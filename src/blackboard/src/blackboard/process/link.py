# SPDX-License-Identifier: BSD-3-Clause
"""What carries a process's messages to other processes: ROS or Zenoh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Collection


@dataclass(frozen=True)
class Arrival:
    """A message that has come in, and has not been read yet.

    Attributes:
        topic: Its topic, one of `codec.tables.WIRES`.
        name: The topic's name below the hive; for `set_state` with the robot's namespace.
        sender: The process that has sent it.
        to: The robot of this process that it is for; empty if it is for all members here.
        read: Returns the message; raises ValueError or genpy.DeserializationError if it is none.
    """

    topic: str
    name: str
    sender: str
    read: Callable[[], Any]
    to: str = ""


class Inbox(Protocol):
    """What a link needs of the talker whose messages it carries."""

    spins: bool  # whether the talker's thread runs

    def receive(self, arrival: Arrival) -> None:
        """Take a message from another process; any thread may call this."""

    def node_of(self, name: str) -> str:
        """Return the process that speaks for a member or a robot; empty if unknown."""

    def call(self, action: Callable[[], None]) -> None:
        """Run an action in the talker's thread; any thread may call this."""

    def every(self, period: float, action: Callable[[], None]) -> object:
        """Call repeatedly in the talker's thread [s]."""

    def after(self, delay: float, action: Callable[[], None]) -> object:
        """Call once in the talker's thread, after a delay [s]."""


class Link(Protocol):
    """Carries messages between this process and others.

    Attributes:
        names: Those as which this process speaks, as others see it; one of them for all members,
            or one for each of its robots.
    """

    names: tuple[str, ...]

    def attach(self, inbox: Inbox) -> None:
        """Deliver from now on to this talker; called once, before anything else."""

    def publish(self, robot: str, topic: str, value: object, to: Collection[str] | None) -> None:
        """Send a value of the core to other processes.

        Args:
            robot: Whose member says it; empty if that of no robot.
            topic: On which it is said.
            value: What is said.
            to: Names of members or robots; those that are known to be neither may be left out.
                None: it is for everybody.
        """

    def listen(self, topic: str, name: str) -> None:
        """Deliver what others say on a topic, by its name below the hive; called once for each."""

    def why_refused(self, value: object, sender: str) -> str:
        """Return why a process may not say this; empty if it may, or if nobody can tell."""

    def watch(self, watcher: str, node: str, died: Callable[[], None]) -> None:
        """Call once in the talker's thread when a process is proved dead.

        Watching another one for the same watcher ends the previous watch.
        """
