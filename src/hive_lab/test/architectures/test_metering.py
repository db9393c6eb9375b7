# SPDX-License-Identifier: BSD-3-Clause
"""Each node of a metered network is charged for what it hears and computes."""

import io
import itertools
import time
from dataclasses import replace
from random import Random

import pytest

from blackboard.codec.tables import WIRES
from blackboard.domain.talker import NEW_TASK
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose
from hive_lab.architectures import metering
from hive_lab.architectures.metering import MeteredNetwork, MeteredTalker

TASK = Task("T1", TaskType.GA, (Pose(1.0, 2.0),))


@pytest.fixture
def network(monkeypatch):
    """Return a network on which every look at the processor's clock takes a second."""
    ticks = itertools.count()
    monkeypatch.setattr(time, "thread_time", lambda: float(next(ticks)))
    return MeteredNetwork(Random(1))


def talker(network, name):
    network.add_host(name).boot()
    return MeteredTalker(network, name)


def test_a_message_counts_for_every_node_that_hears_it_but_not_for_its_sender(network):
    speaker, listener = talker(network, "a"), talker(network, "b")
    for each in (speaker, listener):
        each.subscribe(NEW_TASK, lambda _: None)

    speaker.publish(NEW_TASK, TASK)
    network.run(1.0)

    buffer = io.BytesIO()
    WIRES[NEW_TASK].encode(TASK).serialize(buffer)
    assert network.accounts["b"].messages == 1
    assert network.accounts["b"].size == buffer.tell()
    assert network.accounts["b"].sizes == {NEW_TASK: buffer.tell()}
    assert network.accounts["a"].messages == network.accounts["a"].size == 0


def test_whoever_reads_a_message_pays_for_decoding_it(network):
    speaker, reader, busy = (talker(network, name) for name in "abc")
    reader.subscribe(NEW_TASK, lambda _: None)
    busy.subscribe(NEW_TASK, lambda _: None, when=lambda: False)

    speaker.publish(NEW_TASK, TASK)
    network.run(1.0)

    assert network.accounts["b"].spent == 2.0  # the event, and the decoding
    assert network.accounts["c"].spent == 1.0


def test_the_sender_does_not_pay_for_the_decoding_that_is_only_measured(network):
    speaker = talker(network, "a")
    speaker.after(0.5, lambda: speaker.publish(NEW_TASK, TASK))

    network.run(1.0)

    # The clock is looked at twice more while it sends; a second of these three is the decoding.
    assert network.accounts["a"].spent == 2.0


def test_what_a_node_is_charged_with_is_added_to_its_event(network):
    node = talker(network, "a")
    node.after(0.5, lambda: network.charge(10.0))

    network.run(1.0)

    assert network.accounts["a"].spent == 11.0


def test_a_message_that_is_sent_again_is_known_however_many_come_between(network, monkeypatch):
    monkeypatch.setattr(metering, "_IN_FLIGHT", 2)
    speaker, listener = talker(network, "a"), talker(network, "b")
    listener.subscribe(NEW_TASK, lambda _: None)
    others = [replace(TASK, id=f"T{number}") for number in range(2, 4)]

    for end, pair in ((1.0, (TASK, others[0])), (2.0, (TASK, others[1]))):
        for task in pair:
            speaker.publish(NEW_TASK, task)
        network.run(end)

    assert network.accounts["b"].messages == 4
