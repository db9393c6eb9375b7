# SPDX-License-Identifier: BSD-3-Clause
"""A leader that speaks over Zenoh on this machine's loopback, and waiting for what it causes."""

import queue
import socket

import pytest

pytest.importorskip("blackboard.msg", reason="the link needs generated messages")


from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.domain.record import TaskRecord
from blackboard.domain.talker import (
    BACKUP,
    NEW_TASK,
    ROBOT_STATUS,
    SET_STATE,
    SYNC,
    TASK_CANCEL,
    TASK_STATE,
)
from blackboard.zenoh.link import ZenohLink, serialized
from blackboard.zenoh.opening import open_session
from blackboard.zenoh.session import Endpoints, session_config
from fleet_manager.client.topics import ZONE_COMMAND
from fleet_manager.codec.operator_wires import OPERATOR_WIRES
from fleet_manager.config.zenoh_operator import operator_site
from fleet_manager.zenoh.hive_topics import joined

WITHIN = 20.0  # a busy machine needs no longer [s]
SAYS = (BACKUP, ROBOT_STATUS, SYNC, TASK_STATE)
STAMP = 7.0


class Leader:
    """The blackboard of a hive, which tells what it is asked, and answers on request.

    Attributes:
        asked: What operators asked for, in order, as (topic, value).
        answers: Whether posted tasks get on the list.
    """

    spins = True

    def __init__(self):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
        self.session = open_session(session_config(Endpoints((self.endpoint,))))
        self.asked = queue.Queue()
        self.answers = False
        self._records = ()
        self._links = {}
        self.link("blackboard", (NEW_TASK, TASK_CANCEL, ZONE_COMMAND))
        self.link("robot1", (f"robot1/{SET_STATE}",))

    def link(self, name, hears=()):
        """Return the link of a member, which all speak in this one session."""
        if name not in self._links:
            link = self._links[name] = ZenohLink(
                self.session, "hive", name, SAYS, date=lambda: STAMP, wires=OPERATOR_WIRES
            )
            link.attach(self)
            for topic in hears:
                link.listen(topic.rpartition("/")[2], topic)
        return self._links[name]

    def beat(self, **told):
        """Say that the blackboard leads."""
        self.say(BACKUP, Heartbeat(1, "/blackboard", "", ("/blackboard",), **told))

    def say(self, topic, value, by="blackboard"):
        """Say something as a member."""
        self.link(by).publish(by, topic, value, None)

    def show(self, robot, topic, msg):
        """Say something for display as a robot."""
        self.session.put(f"hive/hive/{robot}/{topic}/{robot}", serialized(msg))

    def receive(self, arrival):
        """Take what an operator asks for."""
        value = OPERATOR_WIRES[arrival.topic].from_msg(arrival.read())
        self.asked.put((arrival.topic, value))
        if self.answers and arrival.topic == NEW_TASK:
            self._records = (*self._records, TaskRecord(value))
            self.say(TASK_STATE, self._records[-1].told(1))
            self.say(SYNC, TaskList(1, len(self._records), self._records, "hive1"))

    def call(self, action):
        """Run what the link has to do."""
        action()

    def node_of(self, name):
        """Return the process of a member."""
        return name

    def after(self, _delay, _action):
        """Watch nobody."""


@pytest.fixture
def leader():
    """A leader, which ends with the test."""
    leader = Leader()
    yield leader
    leader.session.close()


@pytest.fixture
def site(leader):
    """How an operator's program reaches the leader."""
    return operator_site([leader.endpoint])


@pytest.fixture
def session(site):
    """A session of an operator's program."""
    with joined(site) as session:
        yield session


@pytest.fixture
def until_followed(leader, until_heard):
    """Wait until somebody listens to topics of the hive; all but the traffic if none is named."""

    def until_followed(*names):
        for name in names or SAYS:
            until_heard(leader.session, f"hive/hive/{name}/blackboard")

    return until_followed
