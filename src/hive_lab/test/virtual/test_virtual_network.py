# SPDX-License-Identifier: BSD-3-Clause
"""The time and the network that all other tests run on."""

import random

import pytest

from hive_lab.virtual.network import LATENCY, Encoded, Network, NetworkTalker


def test_time_passes_from_one_thing_that_happens_to_the_next():
    network = Network()
    seen = []
    network.schedule(2.0, lambda: seen.append(("second", network.now)))
    network.schedule(1.0, lambda: seen.append(("first", network.now)))

    network.run(5.0)

    assert seen == [("first", 1.0), ("second", 2.0)]
    assert network.now == 5.0


def test_what_is_due_at_the_same_time_happens_in_the_order_it_was_asked_for():
    network = Network()
    seen = []
    for number in range(5):
        network.schedule(1.0, lambda number=number: seen.append(number))

    network.run(1.0)

    assert seen == [0, 1, 2, 3, 4]


def test_a_call_that_was_cancelled_does_not_happen():
    network = Network()
    seen = []
    call = network.schedule(1.0, lambda: seen.append("happened"))

    call.cancel()
    network.run(2.0)

    assert not seen


def test_a_message_reaches_everyone_after_the_latency_the_sender_included():
    network = Network()
    seen = []
    one, other = NetworkTalker(network, "one"), NetworkTalker(network, "other")
    one.subscribe("topic", lambda message: seen.append(("one", message, network.now)))
    other.subscribe("topic", lambda message: seen.append(("other", message, network.now)))

    one.publish("topic", "hello")
    network.run(1.0)

    assert seen == [("one", "hello", LATENCY), ("other", "hello", LATENCY)]
    assert network.heard == [("topic", "hello")]


def test_on_one_topic_one_listener_hears_in_the_order_of_sending_whatever_the_delays():
    generator = random.Random(1)
    network = Network(delay=lambda: generator.uniform(0.0, 1.0))
    seen = []
    talker = NetworkTalker(network, "one")
    talker.subscribe("topic", seen.append)
    for number in range(20):
        talker.publish("topic", number)

    network.run(5.0)

    assert seen == list(range(20))


def test_between_topics_a_later_message_may_come_first():
    delays = iter([0.5, 0.1])
    network = Network(delay=lambda: next(delays))
    seen = []
    talker = NetworkTalker(network, "one")
    talker.subscribe("slow", seen.append)
    talker.subscribe("fast", seen.append)
    talker.publish("slow", "sent first")
    talker.publish("fast", "sent second")

    network.run(1.0)

    assert seen == ["sent second", "sent first"]


def test_a_lost_message_reaches_nobody():
    network = Network(lose=lambda _topic, message: message == "lost")
    seen = []
    talker = NetworkTalker(network, "one")
    talker.subscribe("topic", seen.append)
    talker.publish("topic", "lost")
    talker.publish("topic", "kept")

    network.run(1.0)

    assert seen == ["kept"]
    assert network.heard == [("topic", "kept")]
    assert network.sent == [("topic", "lost"), ("topic", "kept")]


def test_set_state_belongs_to_one_member_and_all_else_to_the_hive():
    network = Network()
    seen = []
    NetworkTalker(network, "one").subscribe("set_state", seen.append)

    network.send("one/set_state", "for one")
    network.send("other/set_state", "for another")
    network.run(1.0)

    assert seen == ["for one"]


def test_a_periodic_call_comes_after_each_period_until_it_is_cancelled():
    network = Network()
    seen = []
    timer = NetworkTalker(network, "one").every(1.0, lambda: seen.append(network.now))

    network.run(3.5)
    timer.cancel()
    network.run(3.0)

    assert seen == [1.0, 2.0, 3.0]


def test_a_member_without_a_network_hears_and_says_nothing_but_goes_on():
    network = Network()
    heard, ticks = [], []
    talker = NetworkTalker(network, "one")
    talker.subscribe("topic", heard.append)
    talker.every(1.0, lambda: ticks.append(network.now))

    talker.connected = False
    talker.publish("topic", "mute")
    network.send("topic", "deaf")
    network.run(2.0)

    assert (heard, ticks) == ([], [1.0, 2.0])
    assert network.heard == [("topic", "deaf")]


def test_a_member_whose_process_has_ended_does_nothing_any_more():
    network = Network()
    ticks = []
    talker = NetworkTalker(network, "one")
    talker.every(1.0, lambda: ticks.append("every"))
    talker.after(1.0, lambda: ticks.append("after"))

    talker.running = False
    network.run(3.0)

    assert not ticks


def test_waiting_for_something_ends_when_it_is_so_or_at_the_limit():
    network = Network()
    network.schedule(2.0, lambda: None)

    assert network.run_until(lambda: network.now >= 2.0, limit=10.0)
    assert network.now == 2.0
    assert not network.run_until(lambda: False, limit=10.0)
    assert network.now == 12.0


def test_whoever_watches_looks_after_everything_that_happens():
    network = Network()
    looks = []
    network.watch(lambda: looks.append(network.now))
    network.schedule(1.0, lambda: None)
    network.schedule(2.0, lambda: None)

    network.run(5.0)

    assert looks == [1.0, 2.0]


def test_who_listens_no_longer_hears_nothing_more():
    network = Network()
    heard = []
    ear = NetworkTalker(network, "one").subscribe("topic", heard.append)
    network.send("topic", "before")
    network.run(1.0)

    ear.cancel()
    network.send("topic", "after")
    network.run(1.0)

    assert heard == ["before"]


def test_an_exception_of_a_handler_passes_unless_the_network_survives_it():
    def fail(_):
        raise KeyError("a defect")

    strict, forgiving = Network(), Network(survives=True)
    talker = NetworkTalker(forgiving, "one")
    for network, each in ((strict, NetworkTalker(strict, "one")), (forgiving, talker)):
        each.subscribe("task_cancel", fail)
        network.send("task_cancel", "T1")
    with pytest.raises(KeyError):
        strict.run(1.0)
    forgiving.run(1.0)

    assert talker.failures.by_topic() == {"task_cancel": 1}


def test_an_encoded_message_is_decoded_by_each_member_and_is_not_among_what_was_sent():
    network, heard = Network(), []
    for name in ("one", "two"):
        NetworkTalker(network, name).subscribe("task_cancel", heard.append)
    network.deliver("task_cancel", Encoded(b"T1", bytes.decode))
    network.deliver("task_cancel", Encoded(b"\xff", bytes.decode))
    network.run(1.0)

    assert heard == ["T1", "T1"]
    assert network.sent == []
