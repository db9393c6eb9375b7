# SPDX-License-Identifier: BSD-3-Clause
"""Notices when the ROS master goes and comes, and makes a node known to a new one.

A master that was started anew knows nobody. The connections between nodes live on, but nobody new
would find this node, so all its topics are registered again, without cutting what is connected.
"""

from __future__ import annotations

import xmlrpc.client
from typing import TYPE_CHECKING, Any

import rosgraph
import rospy
from rospy.impl.registration import get_topic_manager

from fleet_manager.desk.facts import LinkState

if TYPE_CHECKING:
    from collections.abc import Iterator

PATIENCE = 2.0  # [s] that a master may take to answer


class _Transport(xmlrpc.client.Transport):
    """A connection that does not wait for ever for a master that is frozen."""

    def make_connection(self, host: object) -> object:  # type: ignore[override]  # typed loosely
        connection = super().make_connection(host)  # type: ignore[arg-type]  # typed loosely
        connection.timeout = PATIENCE
        return connection


class MasterWatch:
    """Asks the master for its process id.

    Not for several threads. A call takes at most `PATIENCE`.

    Args:
        caller: Name that the master is told.

    Attributes:
        address: Of the master, for a person.
    """

    def __init__(self, caller: str) -> None:
        self.address = rosgraph.get_master_uri()
        self._caller = caller
        self._pid: int | None = None
        self._is_lost = False

    def is_up(self) -> bool:
        """Return whether the master answers."""
        pid = self._ask()
        if pid is not None:
            self._pid = pid
        return pid is not None

    def look(self) -> Iterator[LinkState]:
        """Give what changed since the last look: LOST, or UP when it is back."""
        pid = self._ask()
        if pid is None:
            if not self._is_lost:
                self._is_lost = True
                yield LinkState.LOST
            return
        if pid != self._pid:
            self._register_again()
            self._pid = pid
        if self._is_lost:
            self._is_lost = False
            yield LinkState.UP

    def _ask(self) -> int | None:
        try:
            with xmlrpc.client.ServerProxy(self.address, _Transport()) as master:
                answer: Any = master.getPid(f"/{self._caller}")
        except (OSError, xmlrpc.client.Error):
            return None
        return int(answer[2])

    def _register_again(self) -> None:
        """Tell a new master of this node's topics, and connect to those who did the same."""
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
            rospy.logwarn(f"the new ROS master at {self.address} did not take this node: {error}")
