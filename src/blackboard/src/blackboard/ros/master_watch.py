# SPDX-License-Identifier: BSD-3-Clause
"""Notices when the ROS master goes and comes back, and registers the node with a new one.

A master that was restarted knows no node. Connections between nodes last, but no new node would
find this one, so it registers all its topics again without closing a connection.
"""

from __future__ import annotations

import contextlib
import threading
import xmlrpc.client
from enum import Enum
from typing import TYPE_CHECKING, Any

import rosgraph
import rospy
from rospy.impl.registration import get_topic_manager

if TYPE_CHECKING:
    from collections.abc import Callable

PATIENCE = 2.0
"""Time that the master may take to answer [s]."""

PERIOD = 2.0
"""Time between two checks [s]; one costs master and node well under a millisecond each."""


class MasterState(Enum):
    """What changed about the master."""

    LOST = "lost"  # it no longer answers
    BACK = "back"  # it answers again


class _Transport(xmlrpc.client.Transport):
    """A connection that does not wait forever for a frozen master."""

    def make_connection(self, host: object) -> object:  # type: ignore[override]  # typed loosely
        connection = super().make_connection(host)  # type: ignore[arg-type]  # typed loosely
        connection.timeout = PATIENCE
        return connection


class MasterWatch:
    """Asks the master for its process id.

    It is not thread-safe. A call takes at most `PATIENCE`.
    """

    def __init__(self, caller: str) -> None:
        self.address = rosgraph.get_master_uri()
        self._caller = caller
        self._pid: int | None = None
        self.is_lost = False  # whether it did not answer at the last look

    def is_up(self) -> bool:
        """Return whether the master answers."""
        pid = self._ask()
        if pid is not None:
            self._pid = pid
        return pid is not None

    def look(self) -> MasterState | None:
        """Return what changed since the last check, and register with a new master.

        A master that does not accept this node counts as lost; the next check tries again.
        """
        pid = self._ask()
        is_new = pid is not None and self._pid is not None and pid != self._pid
        if pid is None or (is_new and not self._register_again()):
            was_lost, self.is_lost = self.is_lost, True
            return None if was_lost else MasterState.LOST
        self._pid = pid
        was_lost, self.is_lost = self.is_lost, False
        return MasterState.BACK if was_lost else None

    def _ask(self) -> int | None:
        try:
            with xmlrpc.client.ServerProxy(self.address, _Transport()) as master:
                answer: Any = master.getPid(self._caller)
        except (OSError, xmlrpc.client.Error):
            return None
        return int(answer[2])

    def _register_again(self) -> bool:
        """Register all topics and connect to nodes that did the same; return whether it worked."""
        name, uri, topics = rospy.get_name(), rospy.get_node_uri(), get_topic_manager()
        try:
            with xmlrpc.client.ServerProxy(self.address, _Transport()) as master:
                for topic, kind in topics.get_publications():
                    master.registerPublisher(name, topic, kind, uri)
                for topic, kind in topics.get_subscriptions():
                    answer: Any = master.registerSubscriber(name, topic, kind, uri)
                    with xmlrpc.client.ServerProxy(uri, _Transport()) as node:
                        node.publisherUpdate("/master", topic, answer[2])
        except (OSError, xmlrpc.client.Error) as error:
            rospy.logwarn(
                f"the new ROS master at {self.address} did not accept this node: {error}"
            )
            return False
        return True


def watch_master(tell: Callable[[MasterState], None]) -> None:
    """Watch the master while this node runs, in a thread that calls `tell` at every change."""
    watch = MasterWatch(rospy.get_name())
    watch.is_up()
    ended = threading.Event()
    rospy.on_shutdown(ended.set)

    def look() -> None:
        while not ended.wait(PERIOD):
            with contextlib.suppress(rospy.ROSException):
                change = watch.look()
                if change is not None:
                    tell(change)

    threading.Thread(target=look, name="master watch", daemon=True).start()
