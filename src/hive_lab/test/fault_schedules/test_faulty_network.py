# SPDX-License-Identifier: BSD-3-Clause
"""Processes of a simulated hive that are suspended, or held up by their disks."""

from random import Random

import pytest

from hive_lab.fault_schedules.faulty_network import FaultyNetwork, HostTalker


@pytest.fixture
def host():
    """Return a process that runs."""
    host = FaultyNetwork(Random(1)).add_host("robot1")
    host.boot()
    return host


def test_after_a_freeze_overdue_timers_fire_before_the_messages_that_have_arrived(host):
    talker, heard = HostTalker(host), []
    talker.subscribe("topic", heard.append)
    talker.publish("topic", "a message")
    talker.after(1.0, lambda: heard.append("a timer"))
    host.frozen = True
    host.network.run(2.0)

    host.thaw()

    assert heard == ["a timer", "a message"]


def test_a_process_that_is_held_up_again_after_a_freeze_loses_nothing(host):
    talker, heard = HostTalker(host), []

    def write(word):
        heard.append(word)
        host.hold_up(0.3)

    talker.subscribe("topic", write)
    for number in range(4):
        talker.publish("topic", f"message {number}")
    talker.after(0.5, lambda: write("a timer"))
    host.frozen = True
    host.network.run(1.0)

    host.thaw()
    host.network.run(3.0)

    assert heard == ["a timer", *(f"message {number}" for number in range(4))]
