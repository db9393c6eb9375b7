# SPDX-License-Identifier: BSD-3-Clause
"""No message of an AGV makes its agent fall over: refusals are said once, and counted."""

import copy
import json
import random

import pytest

from hive_common.pose import Pose
from hive_navigation.control.navigator import Navigator
from hive_navigation.planning.ompl_planner import OmplPlanner
from hive_navigation.traffic.neighbourhood import Neighbourhood
from robot_description.models import load_model
from simenv.testing import hall
from simenv.world.draw_map import draw_map
from vda5050.agent.agv import Agv
from vda5050.agent.inspection import FORGOTTEN, FROM_AGVS, Inspector
from vda5050.agent.maker import Maker
from vda5050.agent.order_follower import Tolerance
from vda5050.protocol.codec import encode
from vda5050.protocol.header import Header, timestamp_of
from vda5050.protocol.topics import Topic
from vda5050.protocol.versions import Version
from vda5050.simulated.testing import Rig

MESSAGES = 5000
MAY_1 = 1_714_500_000.0  # the time of day at the start [s since 1970]
ODD = [None, True, -1, 0, 1e308, 2**70, "", "x" * 1000, [], {}, [[]], {"key": {}}, -0.5, "ONLINE"]
ODD += ["\x00", "2199-01-01T00:00:00Z", "p1-1", "nobody-1", "FATAL", "8"]


class Desk:
    """An agent that hears messages and drives somewhere all the while."""

    def __init__(self, version):
        self.rig = Rig(version)
        self.now, self.said, self.sent = 0.0, [], []
        model = load_model("mir100")
        planner = OmplPlanner(draw_map(hall()), model.base.circumscribed_radius)
        self.agent = Agv(
            "agv",
            model,
            Maker(map_id="hall"),
            lambda body: bool(self.sent.append(body)) or True,
            "p1",
            lambda: self.now,
            self.said.append,
            Tolerance(0.2, 0.2),
            planner.field,
        )
        follower, field = self.agent.follower, planner.field
        self.agent.use(Navigator("agv", model, planner, follower, field), field)
        self.agent.presence.note_broker(connected=True, now=0.0)
        self.inspector = Inspector(
            self.rig.address,
            version,
            lambda: MAY_1 + self.now,
            self.agent.keeper.knows,
            self.said.append,
        )

    def hear(self, topic, payload):
        body = self.inspector.read(topic, payload)
        if body is not None:
            self.agent.hear(body)

    def pass_time(self):
        self.now += 0.1
        self.agent.tick(self.now, Neighbourhood())

    def good(self, topic, number=0):
        header = Header(number, timestamp_of(MAY_1 + self.now), self.rig.version.text, "Acme", "7")
        return json.loads(encode(header, self.rig.all(topic)[-1], self.rig.version))


def mutated(content, dice):
    """Return a copy in which a few values are odd or gone."""
    content = copy.deepcopy(content)
    for _ in range(dice.choice((1, 1, 2, 4))):
        holder = content
        while True:
            keys = list(holder) if isinstance(holder, dict) else list(range(len(holder)))
            if not keys:
                break
            key = dice.choice(keys)
            if isinstance(holder[key], dict | list) and holder[key] and dice.random() < 0.7:
                holder = holder[key]
                continue
            if dice.random() < 0.25:
                del holder[key]
            else:
                holder[key] = copy.deepcopy(dice.choice(ODD))
            break
    return content


@pytest.mark.parametrize("topic", FROM_AGVS, ids=lambda topic: topic.value)
def test_odd_messages_are_refused_once_in_words_and_do_no_harm(topic):
    desk, dice = Desk(Version.V2_1), random.Random(11)
    results = []
    desk.hear(Topic.STATE, json.dumps(desk.good(Topic.STATE)).encode())
    for number in range(MESSAGES):
        if number % 500 == 0:
            desk.agent.drive(Pose(7.0, 7.0), results.append)
        payload = json.dumps(mutated(desk.good(topic, number), dice)).encode()
        cut = dice.random() < 0.05
        desk.hear(topic, payload[: dice.randrange(len(payload))] if cut else payload)
        if number % 10 == 0:
            desk.pass_time()
    refused = desk.inspector.refused
    about = [line for line in desk.said if "refused a message" in line]
    assert sum(refused.values()) > MESSAGES / 10
    assert len(about) == len(refused)

    desk.now += FORGOTTEN + 1.0
    desk.agent.stop()
    good = desk.good(Topic.STATE, 2 * MESSAGES)
    desk.hear(Topic.STATE, json.dumps(good).encode())
    assert desk.agent.state is not None
    assert desk.agent.state.mobile_robot_position.x == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        ({"serialNumber": "8"}, "sender"),
        ({"timestamp": timestamp_of(MAY_1 + 3600.0)}, "future"),
        ({"orderId": "p1-7", "orderUpdateId": 3}, "echo"),
        ({"nodeStates": "none"}, "schema"),
    ],
)
def test_a_state_that_cannot_be_true_is_refused_and_counted(change, kind):
    desk = Desk(Version.V2_1)
    for number in range(3):
        desk.hear(Topic.STATE, json.dumps(desk.good(Topic.STATE, number) | change).encode())

    assert desk.inspector.refused == {(Topic.STATE, kind): 3}
    assert len(desk.said) == 1
    assert desk.agent.state is None


def test_a_state_that_comes_late_is_refused():
    desk = Desk(Version.V2_1)
    late = json.dumps(desk.good(Topic.STATE, 4)).encode()
    desk.now += 1.0
    desk.hear(Topic.STATE, json.dumps(desk.good(Topic.STATE, 5)).encode())
    desk.hear(Topic.STATE, late)

    assert desk.inspector.refused == {(Topic.STATE, "old"): 1}


def test_ten_megabytes_are_refused_unread():
    desk = Desk(Version.V2_1)
    desk.hear(Topic.STATE, b"[" * 10_000_000)

    assert desk.inspector.refused == {(Topic.STATE, "size"): 1}
