# SPDX-License-Identifier: BSD-3-Clause
"""Who is connected to whom in a ROS system."""

from __future__ import annotations

import contextlib
import xmlrpc.client
from typing import Any

import rosgraph

_ASKS = "/operator"


def is_heard(node: str, topic: str, listener: str) -> bool:
    """Return whether what a node says on a topic goes to a listener.

    A listener knows of a connection before it stands; who speaks knows of it afterwards.
    """
    with contextlib.suppress(OSError, rosgraph.MasterException, xmlrpc.client.Error):
        uri = rosgraph.Master(_ASKS).lookupNode(node)
        with xmlrpc.client.ServerProxy(uri) as slave:
            answer: Any = slave.getBusInfo(_ASKS)
        return any((link[1], link[2], link[4]) == (listener, "o", topic) for link in answer[2])
    return False
