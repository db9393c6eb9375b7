# SPDX-License-Identifier: BSD-3-Clause
"""Makes the connections that rospy loses while a whole system starts.

A node that subscribes is told by the master who publishes, and from then on is sent the news.
rospy puts both into one queue and believes what was put in last. Where the first publisher
registers in between, the older answer, "nobody", is put in last: then it is never connected, and
nothing says so. So every node looks again a few times after its start. The nodes of the
blackboard do the same with a copy of their own, because neither package knows the other.

And rospy lets five callers wait at its door. Of more that come at once the system leaves out some,
which call again a second later, then after two more; so a node has room for as many as it may.
"""

from __future__ import annotations

import contextlib
import functools
import socket
import threading
import xmlrpc.client
from collections import defaultdict

import rosgraph
import rospy
from rospy.impl.registration import Registration, get_topic_manager
from rospy.impl.tcpros_base import init_tcpros_server

PAUSES = (4.0, 4.0, 8.0, 16.0, 32.0)
"""Between the start of a node and its looks at its connections [s, wall clock]."""


def mend_links() -> None:
    """Let all in who call, and look a few times for lost connections; after `rospy.init_node`."""
    init_tcpros_server().tcp_ros_server.server_sock.listen(socket.SOMAXCONN)
    threading.Thread(target=_keep_looking, name="links", daemon=True).start()


def _keep_looking() -> None:
    ended = threading.Event()
    rospy.on_shutdown(ended.set)
    lacked: set[tuple[str, str]] = set()
    for pause in PAUSES:
        if ended.wait(pause):
            return
        with contextlib.suppress(OSError, rosgraph.MasterException, xmlrpc.client.Error):
            lacking = overlooked()
            # What rospy is about to connect by itself must not be connected twice: of two
            # connections each side may drop another one.
            connect(lacking & lacked)
            lacked = lacking


def overlooked() -> set[tuple[str, str]]:
    """Return topics, and on each the address of a node, that should be heard and is not.

    Addresses are asked for only of nodes that no connection bears the name of: all nodes look at
    once after a start, and the master answers one call after the other.

    Raises:
        OSError: The master cannot be reached.
        rosgraph.MasterException: The master knows less than it has just said.
    """
    master = rosgraph.Master(rospy.get_name())
    address = functools.cache(master.lookupNode)
    publishers, linked = dict(master.getSystemState()[0]), _linked()
    return {
        (topic, address(node))
        for topic, _ in get_topic_manager().get_subscriptions()
        for node in set(publishers.get(topic, ())) - _heard(topic)
    } - {(topic, each) for topic, known in linked.items() for each in known}


def connect(lacking: set[tuple[str, str]]) -> None:
    """Connect this node to others, and keep the connections that it has.

    Args:
        lacking: Topics, and on each the address of a node.

    Raises:
        OSError: This node cannot be reached.
    """
    linked = _linked()
    for topic in {topic for topic, _ in lacking}:
        wanted = {address for each, address in lacking if each == topic}
        with xmlrpc.client.ServerProxy(rospy.get_node_uri()) as this_node:
            this_node.publisherUpdate("/master", topic, sorted(linked[topic] | wanted))


def _heard(topic: str) -> set[str]:
    """Return the names of the nodes that this node is connected to and hears on a topic."""
    subscription = get_topic_manager().get_impl(Registration.SUB, topic)
    return {each.callerid_pub for each in subscription.connections} if subscription else set()


def _linked() -> dict[str, set[str]]:
    """Return the addresses that this node is connected to, by topic."""
    linked = defaultdict(set)
    for _, address, direction, _, topic, *_ in get_topic_manager().get_pub_sub_info():
        if direction == "i":
            linked[topic].add(address)
    return linked
