# SPDX-License-Identifier: BSD-3-Clause
"""Keeps a peer that stops in the middle of connecting from shutting out all others.

rospy accepts connections in one thread, and reads there who calls and what for. A caller that is
frozen, or whose host vanishes, between its connection and its first words holds that thread for as
long as it is silent; until then nobody else is let in.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from rospy.impl.tcpros_base import init_tcpros_server

if TYPE_CHECKING:
    import socket


def take_each_apart() -> None:
    """Let every caller of this node have a thread for its first words; after `rospy.init_node`."""
    server = init_tcpros_server()
    server.start_server()
    take = server.tcp_ros_server.inbound_handler

    def take_apart(caller: socket.socket, address: tuple[str, int]) -> None:
        threading.Thread(
            target=take, args=(caller, address), name=f"handshake {address}", daemon=True
        ).start()

    server.tcp_ros_server.inbound_handler = take_apart
