# SPDX-License-Identifier: BSD-3-Clause
"""Connects a subscriber again that has lost a publisher, for as long as there is that publisher.

rospy 1.15 gives a publisher up for good, and says so in its log file at most, when the connection
ends before or after the handshake, when it is refused or reset, when an answer takes too long (the
socket that it then reads is not connected), and when the master cannot be asked for a parameter.
A publisher announces itself only once, so the subscriber stays deaf to it. Here it asks the
publisher whether it is still one, and connects again.

rospy also connects twice when the master tells of a publisher twice in quick succession, which it
does whenever several nodes start. The subscriber keeps the second connection, and a busy publisher
may keep the first: then nothing is left. Here one attempt is made at a time.

Written for rospy 1.15.15 (Debian 12); see docs/decisions/042.
"""

from __future__ import annotations

import functools
import http.client
import math
import threading
import time
import xml.parsers.expat
import xmlrpc.client
from typing import TYPE_CHECKING, Any

import rospy
import rospy.impl.tcpros_pubsub
from rospy.impl.registration import RegManager, get_registration_listeners, get_topic_manager
from rospy.topics import _SubscriberImpl

from hive_common.ros.signals import is_shutting_down

if TYPE_CHECKING:
    from collections.abc import Callable

    _Link = tuple[str, str]
    """A topic and the address of a publisher."""

FIRST_PAUSE, LONGEST_PAUSE = 0.5, 30.0
"""Pauses before the first attempt and at most; each is twice the one before [s, wall clock]."""

_CALM = 120.0
"""After so long without a loss, the next one is a first one again; an attempt takes 60 s at most
[s, wall clock].
"""

_TIMEOUT = 60.0
"""Time that a host may take to accept a connection, as in rospy [s]."""


@functools.cache
def keep_connected() -> None:
    """Have all subscribers of this node keep their publishers; call it after `rospy.init_node`."""
    listeners = get_registration_listeners().listeners
    node = next(each.handler for each in listeners if isinstance(each, RegManager))
    keeper, remove = _Keeper(node._connect_topic), _SubscriberImpl._remove_connection  # noqa: SLF001  (rospy has no other place for it)

    def remove_connection(subscription: Any, connections: list[Any], lost: Any) -> None:  # noqa: ANN401  (rospy's)
        remove(subscription, connections, lost)
        # A publisher that refuses, mostly because of the type, would refuse again.
        if not subscription.closed and "error" not in (getattr(lost, "header", None) or ()):
            keeper.attempt_later(subscription.resolved_name, lost.endpoint_id)

    node._connect_topic = keeper.attempt  # noqa: SLF001  (see above)
    _SubscriberImpl._remove_connection = remove_connection  # noqa: SLF001  (see above)
    rospy.impl.tcpros_pubsub.robust_connect_subscriber = _connect_once


def _connect_once(
    connection: Any,  # noqa: ANN401  (rospy's)
    host: str,
    port: int,
    uri: str,
    hear: Callable[..., None],
    _topic: str,
) -> None:
    """Connect and read; a connection that fails is closed, and so taken off the subscriber's."""
    try:
        connection.connect(host, port, uri, timeout=_TIMEOUT)
    except Exception:  # noqa: BLE001  (whatever it is; rospy has written it to its log)
        connection.close()
    else:
        connection.receive_loop(hear)


class _Keeper:
    """Makes one attempt at a time to connect a topic with a publisher, and repeats it.

    Args:
        connect: rospy's attempt: given topic and address, it returns 1 and more if there is a
            connection now, whose handshake need not be done.
    """

    def __init__(self, connect: Callable[[str, str], tuple[int, str, int]]) -> None:
        self._connect = connect
        self._lock = threading.Lock()
        self._under_way: set[_Link] = set()
        self._waiting: set[_Link] = set()
        self._pauses: dict[_Link, tuple[float, float]] = {}  # the last one, and when it began

    def attempt(self, topic: str, uri: str) -> tuple[int, str, int]:
        """Connect unless another thread is about to; return what rospy wants to know."""
        link = topic, uri
        with self._lock:
            if link in self._under_way:
                return 1, "another thread is about to", 0
            self._under_way.add(link)
        try:
            answer = self._connect(topic, uri)
        except Exception as error:  # noqa: BLE001  (whatever it is; rospy writes it to its log)
            answer = 0, str(error), 0
        with self._lock:
            self._under_way.discard(link)
        if answer[0] != 1:
            self.attempt_later(topic, uri)
        return answer

    def attempt_later(self, topic: str, uri: str) -> None:
        """Connect after a pause, if that is necessary and possible then."""
        link = topic, uri
        with self._lock:
            if link in self._waiting or is_shutting_down():
                return
            self._waiting.add(link)
            pause = self._next_pause(link)
        timer = threading.Timer(pause, self._attempt_again, link)
        timer.daemon = True
        timer.start()

    def _next_pause(self, link: _Link) -> float:
        now = time.monotonic()
        last, begin = self._pauses.get(link, (0.0, -math.inf))
        pause = min(2 * last, LONGEST_PAUSE) if now < begin + _CALM else FIRST_PAUSE
        self._pauses[link] = pause, now
        return pause

    def _attempt_again(self, topic: str, uri: str) -> None:
        with self._lock:
            self._waiting.discard((topic, uri))
        subscription = get_topic_manager().get_subscriber_impl(topic)
        if is_shutting_down() or subscription is None or not _misses(subscription, uri):
            return
        is_there = _publishes(uri, topic)
        if is_there:
            rospy.loginfo(f"connecting again to {uri} on {topic}")
            self.attempt(topic, uri)
        elif is_there is None:
            self.attempt_later(topic, uri)
        else:
            with self._lock:
                self._pauses.pop((topic, uri), None)


def _misses(subscription: Any, uri: str) -> bool:  # noqa: ANN401  (rospy's)
    """Return whether an open subscription is not connected with a publisher.

    rospy tells of a loss before it takes the connection off the list; it holds the lock meanwhile.
    """
    lock = subscription.c_lock  # None once the subscription is closed
    if lock is None:
        return False
    with lock:
        return not subscription.has_connection(uri)


def _publishes(uri: str, topic: str) -> bool | None:
    """Return whether a node publishes a topic; None if it does not say.

    A process that has ended never comes back under its address: another one tells the master.
    """
    try:
        with xmlrpc.client.ServerProxy(uri) as node:
            answer: Any = node.getPublications(rospy.get_name())
        return topic in {name for name, _ in answer[2]}
    except ConnectionRefusedError:
        return False
    except (OSError, http.client.HTTPException, xmlrpc.client.Error, xml.parsers.expat.ExpatError):
        return None
