# SPDX-License-Identifier: BSD-3-Clause
"""The hive's topics for operators over Zenoh, as `ros.hive_topics` has them on ROS."""

from __future__ import annotations

import os
import time
from contextlib import contextmanager
from threading import RLock
from typing import TYPE_CHECKING

import genpy

from blackboard.board.refusals import Refusals
from blackboard.consensus.messages import Heartbeat
from blackboard.domain import talker as topics
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.zenoh.access import PART
from blackboard.zenoh.link import ZenohLink
from blackboard.zenoh.opening import open_session
from fleet_manager.client.reports import HiveMessage
from fleet_manager.client.topics import AUCTIONS, CHANGES, ZONE_COMMAND, superseded
from fleet_manager.client.traffic import ZoneCommand
from fleet_manager.codec.operator_wires import OPERATOR_WIRES
from fleet_manager.desk.facts import CancelTask, PostTask

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    import zenoh

    from blackboard.process.link import Arrival
    from blackboard.zenoh.session import Own
    from fleet_manager.config.zenoh_operator import OperatorSite
    from fleet_manager.desk.facts import Request
    from fleet_manager.desk.inbox import FactSink

_SPEAKS_ON = (topics.NEW_TASK, topics.TASK_CANCEL, ZONE_COMMAND)

_HEARD_WITHIN = 0.5
"""Time in which a new session learns who listens, and hears the leader [s]."""

_LOOK = 0.005  # [s] between two looks


def _namespace() -> str:
    """Return the namespace in which the hive's nodes run, as ROS's own programs find it."""
    names = os.environ.get("ROS_NAMESPACE", "").strip("/")
    return f"/{names}/" if names else "/"


@contextmanager
def joined(site: OperatorSite) -> Iterator[zenoh.Session]:
    """Open a session for an operator's program; close it at the end.

    Raises:
        NoRouterError: None of its routers answers.
        blackboard.errors.SettingsError: An endpoint or the certificate cannot be used.
    """
    session = open_session(site.settings.session())
    try:
        yield session
    finally:
        session.close()  # type: ignore[no-untyped-call]  # zenoh has no types here


class ZenohTopics:
    """Listens to the hive and speaks to it. Zenoh's threads convert a message and put it away.

    It follows the leader's heartbeats at all times: only a leader may tell what others do. The
    environment's ROS_NAMESPACE is the namespace of the hive's nodes, as on ROS.

    Args:
        session: Open; the caller closes it.
        own: The hive, and as whom it speaks.
        put: Takes in facts.
        met: Called from Zenoh's threads with the name of every robot that reports for the first
            time.
        warn: Tells a person what was refused.

    Attributes:
        heard: Robots whose status has been heard.
        beat: The leader's last heartbeat; None before the first.
        time: The time that the last heartbeat states [s, hive's time]; 0 before the first.
        spins: See `blackboard.process.link.Inbox`.
    """

    def __init__(
        self,
        session: zenoh.Session,
        own: Own,
        put: FactSink,
        met: Callable[[str], None] = lambda _robot: None,
        warn: Callable[[str], None] = lambda _text: None,
    ) -> None:
        self._put, self._met, self._warn = put, met, warn
        self._lock = RLock()
        self._refusals = Refusals(warn)
        self._robots: set[str] = set()
        self._followed: set[str] = set()
        self._keeps_lists = False
        self._list: Arrival | None = None
        self.heard: set[str] = set()
        self.beat: Heartbeat | None = None
        self.time = 0.0
        self.spins = True
        self._link = ZenohLink(
            session,
            own.hive,
            own.name,
            _SPEAKS_ON,
            namespace=_namespace(),
            is_member=False,
            wires=OPERATOR_WIRES,
        )
        self._link.attach(self)
        self.listen((topics.BACKUP,))

    def listen_to_all(self) -> None:
        """Follow everything that the hive says; task lists wait for `read_list`."""
        self._keeps_lists = True
        self.listen((*CHANGES, *AUCTIONS, topics.SYNC))

    def listen(self, names: Iterable[str]) -> None:
        """Follow topics of the hive; those that are followed already stay as they are."""
        for topic in names:
            if topic not in self._followed:
                self._followed.add(topic)
                self._link.listen(topic, topic)

    def read_list(self) -> None:
        """Read the newest task list, if one has come since the last call.

        A long list takes longer to read than all other messages together; see
        `ros.hive_topics.HiveTopics.read_list`.
        """
        arrival, self._list = self._list, None
        if arrival is not None:
            with self._lock:
                self._read(arrival)

    def speak(self, request: Request) -> None:
        """Publish a request, once, as soon as anybody listens.

        It waits for that, and for the leader, whose answer would not be believed before.
        """
        if isinstance(request, PostTask):
            self._publish(topics.NEW_TASK, request.task)
        elif isinstance(request, CancelTask):
            self._publish(topics.TASK_CANCEL, request.task_id)
        elif isinstance(request, ZoneCommand):
            self._publish(ZONE_COMMAND, request)
        elif PART.fullmatch(request.robot):
            self._wait_for(f"{request.robot}/{topics.SET_STATE}")
            self._link.publish_to_robot(request.robot, topics.SET_STATE, request.word)
        else:
            self._warn(f"robot {request.robot[:64]!r} cannot be commanded: it is no name")

    def _publish(self, topic: str, value: object) -> None:
        self._wait_for(topic)
        self._link.publish("", topic, value, None)

    def _wait_for(self, name: str) -> None:
        end = time.monotonic() + _HEARD_WITHIN
        while not (self.beat and self._link.is_heard(name)) and time.monotonic() < end:
            time.sleep(_LOOK)

    # What the link needs; see `blackboard.process.link.Inbox`.

    def receive(self, arrival: Arrival) -> None:
        """Take a message, in a thread of Zenoh's."""
        if self._keeps_lists and arrival.topic == topics.SYNC:
            self._list = arrival
            return
        with self._lock:
            self._read(arrival)

    def node_of(self, _name: str) -> str:
        """Return that nobody is watched."""
        return ""

    def call(self, action: Callable[[], None]) -> None:
        """Run an action while no message is read."""
        with self._lock:
            action()

    def every(self, _period: float, _action: Callable[[], None]) -> None:
        """Do nothing: only members have something to do all the time."""

    def after(self, _delay: float, _action: Callable[[], None]) -> None:
        """Do nothing: only members watch others."""

    def _read(self, arrival: Arrival) -> None:
        topic, sender = arrival.topic, arrival.sender
        try:
            msg = arrival.read()
            report = OPERATOR_WIRES[topic].from_msg(msg)
        except ValueError as error:
            self._refusals.refuse(topic, str(error))
            return
        except genpy.DeserializationError:
            kind = OPERATOR_WIRES[topic].message.__name__
            self._refusals.refuse(topic, f"{sender} sends bytes that are no {kind}")
            return
        if why := self._link.why_refused(report, sender):
            self._refusals.refuse(topic, why)
            return
        stamp = msg.header.stamp.to_sec()
        self._put(HiveMessage(report, stamp), superseded(topic, report))
        # What is counted as heard has been put away before.
        if isinstance(report, Heartbeat):
            self.beat, self.time = report, stamp
        elif isinstance(report, RobotStatus):
            self._note_robot(report)

    def _note_robot(self, status: RobotStatus) -> None:
        if status.robot_id not in self._robots:
            self._robots.add(status.robot_id)
            self._met(status.robot_id)
        if status.state is not RobotState.OFFLINE:
            self.heard.add(status.robot_id)
