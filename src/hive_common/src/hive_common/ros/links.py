# SPDX-License-Identifier: BSD-3-Clause
"""Restores the connections that rospy never makes while a whole system starts.

The master answers a node that subscribes with the list of publishers, and later sends it changes.
rospy queues both and believes whichever it queued last. If the first publisher registers in
between, the older answer, "nobody", may be last: the node then never connects, and nothing says
so. Every node therefore checks its connections a few times after its start
(docs/decisions/042).

rospy also lets only five callers wait to be accepted. If more come at once, Linux drops some,
which try again one second later and then after two more. A node here has room for as many as
allowed. Written for rospy 1.15.15 (Debian 12).
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

from hive_common.ros.reconnecting import keep_connected

PAUSES = (4.0, 4.0, 8.0, 16.0, 32.0)
"""Pauses before the checks after a node's start [s, wall clock]."""


def mend_links() -> None:
    """Accept many callers, keep connections, and check for those that were never made.

    Call it after `rospy.init_node`.
    """
    keep_connected()
    init_tcpros_server().tcp_ros_server.server_sock.listen(socket.SOMAXCONN)
    threading.Thread(target=_keep_checking, name="links", daemon=True).start()


def _keep_checking() -> None:
    ended = threading.Event()
    rospy.on_shutdown(ended.set)
    lacked: set[tuple[str, str]] = set()
    for pause in PAUSES:
        if ended.wait(pause):
            return
        with contextlib.suppress(OSError, rosgraph.MasterException, xmlrpc.client.Error):
            lacking = overlooked()
            # A connection that rospy is about to make must not be made twice: each side may then
            # drop a different one.
            connect(lacking & lacked)
            lacked = lacking


def overlooked() -> set[tuple[str, str]]:
    """Return topics with the address of a publisher that this node should hear and does not.

    This asks for the addresses only of nodes that no connection names: all nodes check at once
    after a start, and the master answers one call at a time.

    Raises:
        OSError: The master cannot be reached.
        rosgraph.MasterException: A node has just ended.
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
    """Connect this node to others and keep its connections.

    Args:
        lacking: Topics with the address of a publisher.

    Raises:
        OSError: This node cannot be reached.
    """
    linked = _linked()
    for topic in {topic for topic, _ in lacking}:
        wanted = {address for each, address in lacking if each == topic}
        with xmlrpc.client.ServerProxy(rospy.get_node_uri()) as this_node:
            this_node.publisherUpdate("/master", topic, sorted(linked[topic] | wanted))


def _heard(topic: str) -> set[str]:
    """Return the names of the publishers that this node is connected to on a topic."""
    subscription = get_topic_manager().get_impl(Registration.SUB, topic)
    return {each.callerid_pub for each in subscription.connections} if subscription else set()


def _linked() -> dict[str, set[str]]:
    """Return the addresses of the publishers that this node is connected to, by topic."""
    linked = defaultdict(set)
    for _, address, direction, _, topic, *_ in get_topic_manager().get_pub_sub_info():
        if direction == "i":
            linked[topic].add(address)
    return linked
