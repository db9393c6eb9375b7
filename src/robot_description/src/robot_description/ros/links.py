# SPDX-License-Identifier: BSD-3-Clause
"""Makes the connections that rospy loses while a whole system starts.

A node that subscribes is told by the master who publishes, and from then on is sent the news.
rospy puts both into one queue and believes what was put in last. Where the first publisher
registers in between, the older answer, "nobody", is put in last: then it is never connected, and
nothing says so. So every node looks again a few times after its start. The nodes of the
blackboard do the same with a copy of their own, because neither package knows the other.
"""

from __future__ import annotations

import contextlib
import threading
import xmlrpc.client
from collections import defaultdict

import rosgraph
import rospy
from rospy.impl.registration import get_topic_manager

PAUSES = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Between the start of a node and its looks at its connections [s, wall clock]."""


def mend_links() -> None:
    """Look a few times for lost connections, in a thread of its own; after `rospy.init_node`."""
    threading.Thread(target=_keep_looking, name="links", daemon=True).start()


def _keep_looking() -> None:
    ended = threading.Event()
    rospy.on_shutdown(ended.set)
    for pause in PAUSES:
        if ended.wait(pause):
            return
        with contextlib.suppress(OSError, rosgraph.MasterException, xmlrpc.client.Error):
            look_again()


def look_again() -> None:
    """Connect this node to every publisher of its topics that it is not connected to.

    Raises:
        OSError: The master or this node cannot be reached.
        rosgraph.MasterException: The master knows less than it has just said.
    """
    master, topics = rosgraph.Master(rospy.get_name()), get_topic_manager()
    publishers = dict(master.getSystemState()[0])
    linked = defaultdict(set)
    for _, node, direction, _, topic, *_ in topics.get_pub_sub_info():
        if direction == "i":
            linked[topic].add(node)
    for topic, _ in topics.get_subscriptions():
        nodes = publishers.get(topic, [])
        if len(linked[topic]) < len(nodes):
            # Those that came since the master answered are not to be dropped again.
            addresses = sorted({*linked[topic], *map(master.lookupNode, nodes)})
            with xmlrpc.client.ServerProxy(rospy.get_node_uri()) as this_node:
                this_node.publisherUpdate("/master", topic, addresses)
