# SPDX-License-Identifier: BSD-3-Clause
"""Subscribes a node's main thread to topics, and warns once about each that stays silent."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import rospy

if TYPE_CHECKING:
    from collections.abc import Callable

    from hive_common.ros.inbox import Inbox

PATIENCE = 10.0  # a topic that has been silent for this long is overdue [s, wall clock]


class TopicMonitor:
    """Watches topics on which messages must keep coming; the clock must never jump [s]."""

    def __init__(self, inbox: Inbox, clock: Callable[[], float] = time.monotonic) -> None:
        self._inbox = inbox
        self._clock = clock
        self._advice: dict[str, str] = {}
        self._heard_at: dict[str, float] = {}
        self._warned: set[str] = set()

    def subscribe(
        self, topic: str, kind: type, handle: Callable[..., None], queue_size: int, advice: str
    ) -> None:
        """Have the main thread handle each message; `advice` says what to do if none come."""

        def heard(msg: object) -> None:
            self.heard(topic)
            handle(msg)

        self.expect(topic, advice)
        rospy.Subscriber(
            topic, kind, lambda msg: self._inbox.put(lambda: heard(msg)), queue_size=queue_size
        )

    def expect(self, topic: str, advice: str) -> None:
        """Start to wait for messages on a topic."""
        self._advice[topic] = advice
        self._heard_at[topic] = self._clock()

    def heard(self, topic: str) -> None:
        """Note that a message came on a topic."""
        self._heard_at[topic] = self._clock()
        self._warned.discard(topic)

    def overdue(self) -> list[str]:
        """Return the overdue topics, each once until a message comes on it again."""
        now = self._clock()
        late = [
            topic
            for topic, heard_at in self._heard_at.items()
            if now - heard_at >= PATIENCE and topic not in self._warned
        ]
        self._warned.update(late)
        return late

    def warn(self) -> None:
        """Log a warning for each overdue topic."""
        for topic in self.overdue():
            name = rospy.resolve_name(topic)
            rospy.logwarn(f"nothing on {name} for {PATIENCE:g} s: {self._advice[topic]}")
