# SPDX-License-Identifier: BSD-3-Clause
"""No message makes an AGV fall over: it refuses, says so, and does the next good order."""

import copy
import json
import random

import pytest

from vda5050.protocol.actions import BlockingType, InstantActions
from vda5050.protocol.codec import encode
from vda5050.protocol.header import Header, timestamp_of
from vda5050.protocol.topics import Topic
from vda5050.protocol.versions import Version
from vda5050.simulated.testing import Rig, action, node, order

MESSAGES = 5000
ODD = [
    None,
    True,
    -1,
    0,
    1e308,
    2**70,
    "",
    "n0",
    "x" * 1000,
    "NaN",
    [],
    {},
    [[]],
    {"key": {}},
    -0.5,
    "HARD",
    "\x00",
    "cancelOrder",
]


def good(rig, topic):
    header = Header(0, timestamp_of(0.0), rig.version.text, "Acme", "7")
    way = [
        node(0, 2, 2),
        node(1, 4, 2, actions=[action("pick", "p1", weight=1.0)]),
        node(2, 6, 2, released=False),
    ]
    bodies = {
        Topic.ORDER: order(way, on_edges={1: [action("wait", "w1", BlockingType.NONE)]}),
        Topic.INSTANT_ACTIONS: InstantActions(
            (
                action("initPosition", "i1", BlockingType.NONE, x=2.0, y=2.0, theta=0.0),
                action("startPause", "i2", BlockingType.NONE),
            )
        ),
    }
    return json.loads(encode(header, bodies[topic], rig.version))


def places(content, path=()):
    """Yield the path of everything in a JSON value."""
    keys = content.keys() if isinstance(content, dict) else range(len(content))
    for key in keys:
        yield (*path, key)
        if isinstance(content[key], dict | list):
            yield from places(content[key], (*path, key))


def mutated(content, dice):
    """Return a copy in which a few values are odd, gone or doubled."""
    content = copy.deepcopy(content)
    for _ in range(dice.choice((1, 1, 1, 2, 5))):
        found = list(places(content))
        if not found:
            return content
        *way, last = dice.choice(found)
        holder = content
        for key in way:
            holder = holder[key]
        what = dice.randrange(4)
        if what == 0:
            del holder[last]
        elif what == 1 and isinstance(holder, list):
            holder.append(holder[last])
        else:
            holder[last] = copy.deepcopy(dice.choice(ODD))
    return content


@pytest.mark.parametrize("topic", [Topic.ORDER, Topic.INSTANT_ACTIONS])
@pytest.mark.parametrize("version", list(Version), ids=lambda version: version.value)
def test_odd_messages_are_refused_and_do_no_harm(topic, version):
    rig, dice = Rig(version), random.Random(7)
    content = good(rig, topic)
    refused = 0
    for number in range(MESSAGES // len(Version)):
        payload = json.dumps(mutated(content, dice)).encode()
        cut = dice.random() < 0.05
        rig.send_bytes(topic, payload[: dice.randrange(len(payload))] if cut else payload)
        if number % 20 == 0:
            rig.run(0.1)
            refused += bool(rig.state.errors)
    assert refused > 10
    assert len(rig.state.errors) <= 12
    assert len(rig.state.instant_action_states) + len(rig.state.action_states) < 50

    rig.instantly("stopPause", "good1")
    rig.instantly("cancelOrder", "good2")
    rig.run_until(lambda: rig.is_idle and not rig.state.driving)
    x, y = rig.pose[:2]
    rig.send(order([node(0, x, y), node(1, 3, 5)], order_id="good"))
    rig.run_until(lambda: rig.state.order_id == "good" and rig.is_idle)
    assert rig.simulation.collisions == 0


def test_a_message_of_ten_megabytes_is_refused(rig):
    rig.send_bytes(Topic.ORDER, b'{"orderId": "' + b"x" * 10_000_000 + b'"}')
    rig.run(0.2)

    assert rig.errors == ["validationError"]


def test_a_message_for_another_serial_number_is_refused_on_our_topic(rig):
    header = Header(0, timestamp_of(0.0), rig.version.text, "Acme", "8")
    rig.send_bytes(Topic.ORDER, encode(header, order([node(0, 2, 2)]), rig.version))
    rig.run(0.2)

    assert rig.errors == ["validationError"]
    assert rig.state.order_id == ""


def test_a_message_on_the_topic_of_another_agv_is_not_for_it(rig):
    header = Header(0, timestamp_of(0.0), rig.version.text, "Acme", "8")
    payload = encode(header, order([node(0, 2, 2)]), rig.version)
    rig.agv.hear("uagv/v2/Acme/8/order", payload)
    rig.run(0.2)

    assert rig.errors == []
    assert rig.state.order_id == ""
