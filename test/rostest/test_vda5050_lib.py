# SPDX-License-Identifier: BSD-3-Clause
"""Software that nobody here wrote, vda-5050-lib, and ours understand each other over a broker.

Its master drives our connector, and its virtual AGV does what our agent wants. Install it with
`test/rostest/vda5050_lib/install`; without it the tests are skipped.
"""

import itertools
import json
import os
import queue
import shutil
import subprocess
import threading
import time
from pathlib import Path

import pytest

from blackboard.domain.task import StepKind, TaskStep
from blackboard.robot.executor import CommandState
from hive_common.map_file import load_map
from hive_common.pose import Pose
from hive_lab.runner.limits import PATIENCE
from hive_navigation.control.navigator import Navigator
from hive_navigation.planning.ompl_planner import OmplPlanner
from hive_navigation.traffic.neighbourhood import Neighbourhood
from robot_description.models import load_model
from vda5050.agent.agv import Agv
from vda5050.agent.maker import Actions, Maker, MakersAction
from vda5050.agent.order_follower import Tolerance
from vda5050.connector.connector import Connector, ConnectorSettings
from vda5050.connector.testing import FakeArm, FakeNavigation
from vda5050.mqtt.link import BrokerSettings, Link, Will
from vda5050.mqtt.local_broker import free_port, local_broker, mosquitto
from vda5050.protocol.codec import decode, encode
from vda5050.protocol.header import Header, timestamp_of
from vda5050.protocol.order import Order
from vda5050.protocol.topics import Address, Topic, parse_topic
from vda5050.protocol.versions import Version
from vda5050.vehicle.channel import Channel

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = Path(__file__).parent / "vda5050_lib"
INSTALLED = ROOT / ".hive" / "vda5050-lib" / "node_modules"
FASTER = 10.0  # how much faster than the wall clock the robot drives

pytestmark = [
    pytest.mark.xdist_group("vda5050-lib"),
    pytest.mark.skipif(shutil.which("node") is None, reason="node is missing: install nodejs"),
    pytest.mark.skipif(
        not (INSTALLED / "vda-5050-lib").is_dir(),
        reason="vda-5050-lib is missing: run test/rostest/vda5050_lib/install",
    ),
    pytest.mark.skipif(mosquitto() is None, reason="mosquitto is missing: ./hive setup"),
]


@pytest.fixture(scope="module")
def broker():
    """Start a broker for these tests; return how to reach it."""
    port = free_port()
    with local_broker(port):
        yield BrokerSettings(port=port)


class NodeScript:
    """A script that runs in node, which gets and tells lines of JSON."""

    def __init__(self, name, *arguments):
        self._process = subprocess.Popen(
            ["node", SCRIPTS / name, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
            env={**os.environ, "NODE_PATH": str(INSTALLED)},
        )
        self._lines = queue.Queue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.told = []

    def _read(self):
        for line in self._process.stdout:
            self._lines.put(json.loads(line))

    def say(self, **what):
        self._process.stdin.write(json.dumps(what) + "\n")

    def expect(self, **wanted):
        """Wait for an event with these values; return it."""
        end = time.monotonic() + PATIENCE
        while True:
            try:
                event = self._lines.get(timeout=max(end - time.monotonic(), 0.0))
            except queue.Empty:
                pytest.fail(f"no {wanted} within {PATIENCE:g} s; told: {self.told}")
            self.told.append(event)
            if all(event.get(key) == value for key, value in wanted.items()):
                return event

    def close(self):
        self._process.stdin.close()
        try:
            self._process.wait(PATIENCE)
        finally:
            self._process.kill()
        self._reader.join()
        self._process.stdout.close()


class Robot:
    """A robot with a navigation that is no more than a straight line, behind our connector."""

    def __init__(self, broker, serial):
        version = Version.V2_0
        self.address = Address.of(version, "Acme", serial)
        self.navigation, self.arm = FakeNavigation(Pose(0.0, 0.0)), FakeArm()
        channel = Channel(self.address, version, self._send, time.time)
        self.connector = Connector(
            ConnectorSettings(version=version, map_id="hall"),
            load_model("fetch"),
            self.navigation,
            self.arm,
            channel,
        )
        self._inbox = queue.Queue()
        self._link = Link(
            broker,
            f"robot-{serial}",
            lambda topic, payload: self._inbox.put((self.connector.hear, topic, payload)),
            lambda _: self._inbox.put((self.connector.endpoint.report.connected,)),
            Will(*channel.will),
        )
        self._link.subscribe(channel.heard)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def _send(self, name, payload, qos, retain):
        self._link.publish(name, payload, qos, retain=retain)

    def __enter__(self):
        self._link.start()
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        self._thread.join()
        self.connector.endpoint.channel.say_goodbye()
        self._link.stop()

    def _run(self):
        before = time.monotonic()
        while not self._ended.wait(0.05):
            now = time.monotonic()
            self.navigation.step(FASTER * (now - before))
            before = now
            while not self._inbox.empty():
                action, *arguments = self._inbox.get()
                action(*arguments)
            if self.arm.is_busy:
                self.arm.end(done=True)
            self.connector.step(now)


@pytest.fixture
def robot(broker, request):
    with Robot(broker, request.node.name[-20:]) as robot:
        yield robot


@pytest.fixture
def master(broker, robot):
    address = robot.address
    script = NodeScript(
        "master.js", str(broker.port), address.interface, address.manufacturer, address.serial
    )
    script.expect(event="connection", state="ONLINE")
    yield script
    script.close()


def order(order_id, *places, actions=(), update=0, first=0):
    """Return an order over places; the last node has actions."""
    nodes = [
        {
            "nodeId": f"n{first + i}",
            "sequenceId": 2 * (first + i),
            "released": True,
            "nodePosition": {"x": x, "y": y, "mapId": "hall", "allowedDeviationXy": 0.5},
            "actions": [],
        }
        for i, (x, y) in enumerate(places)
    ]
    nodes[-1]["actions"] = list(actions)
    edges = [
        {
            "edgeId": f"e{start['nodeId']}",
            "sequenceId": start["sequenceId"] + 1,
            "released": True,
            "startNodeId": start["nodeId"],
            "endNodeId": end["nodeId"],
            "actions": [],
        }
        for start, end in itertools.pairwise(nodes)
    ]
    return {"orderId": order_id, "orderUpdateId": update, "nodes": nodes, "edges": edges}


def action(kind, action_id, **parameters):
    return {
        "actionType": kind,
        "actionId": action_id,
        "blockingType": "HARD",
        "actionParameters": [{"key": key, "value": value} for key, value in parameters.items()],
    }


def test_its_master_drives_our_connector_through_an_order_with_a_pick(master, robot):
    pick = action("pick", "p1", stationType="floor", loadType="EPAL", weight=2.0)
    master.say(order=order("o1", (0, 0), (3, 0), (3, 4), actions=[pick]))

    master.expect(event="node", node="n1")
    master.expect(event="node", node="n2")
    master.expect(event="action", action="p1", status="FINISHED")
    done = master.expect(event="processed", order="o1")
    assert (done.get("error"), done["byCancelation"]) == (None, False)
    assert robot.navigation.pose[:2] == (3.0, 4.0)
    assert robot.arm.orders == [(True, "p1", 2.0)]


def test_its_master_cancels_an_order_of_our_connector(master, robot):
    master.say(order=order("o1", (0, 0), (3, 0), (900, 0)))
    master.expect(event="node", node="n1")
    master.say(instant=action("cancelOrder", "c1"))

    done = master.expect(event="processed", order="o1")
    assert done["byCancelation"]
    x = robot.navigation.pose.x
    master.say(order=order("o2", (x, 0), (x, 2)))
    assert not master.expect(event="processed", order="o2").get("error")


def test_its_master_pauses_our_connector_and_lets_it_go_on(master, robot):
    master.say(order=order("o1", (0, 0), (3, 0), (40, 0)))
    master.expect(event="node", node="n1")
    master.say(instant=action("startPause", "i1"))
    master.expect(event="instant", action="i1", status="FINISHED")
    assert robot.connector.vehicle.is_paused
    master.say(instant=action("stopPause", "i2"))
    master.expect(event="instant", action="i2", status="FINISHED")
    assert not master.expect(event="processed", order="o1").get("error")


def test_its_master_learns_why_our_connector_refuses_an_order(master, robot):
    master.say(order=order("o1", (0, 0), (3, 0), actions=[action("dance", "d1")]))
    assert master.expect(event="processed", order="o1")["error"] == "orderError"
    master.say(order=order("o2", (50, 50), (3, 0)))
    assert master.expect(event="processed", order="o2")["error"] == "noRouteError"
    assert robot.navigation.goals == []


class Agent:
    """Our agent of one AGV, with a navigator of its own and no other robot to hear."""

    def __init__(self, broker, serial):
        self._version = Version.V2_0
        self.address = Address.of(self._version, "Acme", serial)
        self._sent = 0
        load = {"stationType": "floor", "loadType": "EPAL", "duration": 0.5}
        actions = Actions(
            pick=MakersAction(type="pick", load_id="", parameters=load),
            drop=MakersAction(type="drop", load_id="", parameters=load),
        )
        model = load_model("mir100")
        planner = OmplPlanner(load_map("lab"), model.base.circumscribed_radius)
        self.agv = Agv(
            serial,
            model,
            Maker(actions=actions),
            self._send,
            "p1",
            time.monotonic,
            lambda _: None,
            Tolerance(0.2, 0.2),
            planner.field,
        )
        self.agv.use(Navigator(serial, model, planner, self.agv.follower, planner.field))
        self._calls = queue.Queue()
        self.results = queue.Queue()
        self._link = Link(
            broker,
            f"agent-{serial}",
            lambda name, payload: self._calls.put(lambda: self._hear(name, payload)),
            lambda on: self._calls.put(
                lambda: self.agv.presence.note_broker(connected=on, now=time.monotonic())
            ),
        )
        told = (Topic.STATE, Topic.VISUALIZATION, Topic.CONNECTION)
        self._link.subscribe([self.address.topic(topic) for topic in told])
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def _send(self, body):
        topic = Topic.ORDER if isinstance(body, Order) else Topic.INSTANT_ACTIONS
        self._sent += 1
        header = Header(
            self._sent,
            timestamp_of(time.time()),
            self._version.text,
            self.address.manufacturer,
            self.address.serial,
        )
        return self._link.publish(self.address.topic(topic), encode(header, body, self._version))

    def _hear(self, name, payload):
        self.agv.hear(decode(payload, parse_topic(name)[1], self._version).body)

    def __enter__(self):
        self._link.start()
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        self._thread.join()
        self._link.stop()

    def _run(self):
        heard = Neighbourhood()
        while not self._ended.wait(0.05):
            while not self._calls.empty():
                self._calls.get()()
            self.agv.tick(time.monotonic(), heard)

    def call(self, action):
        """Let the agent's thread do something."""
        self._calls.put(action)

    def drive(self, x, y):
        """Have the AGV drive somewhere."""
        self.call(lambda: self.agv.drive(Pose(x, y, 0.0), self.results.put))

    def handle(self, kind):
        """Have the AGV pick or drop."""
        step = TaskStep(kind, Pose(0.0, 0.0), 1.0, "T1")
        self.call(lambda: self.agv.handle(step, self.results.put))

    def expect_success(self):
        """Wait for the end of what the AGV was to do."""
        result = self.results.get(timeout=PATIENCE)
        assert result.state is CommandState.SUCCEEDED, result

    def expect(self, holds):
        """Wait until something holds of the AGV."""
        end = time.monotonic() + PATIENCE
        reached = threading.Event()

        def look():
            if holds(self.agv):
                reached.set()

        while not reached.wait(0.05):
            assert time.monotonic() < end, self.agv.state
            self.call(look)


@pytest.fixture
def agent(broker, request):
    agent = Agent(broker, request.node.name[-20:])
    address = agent.address
    script = NodeScript(
        "agv.js",
        str(broker.port),
        address.interface,
        address.manufacturer,
        address.serial,
        "map",
        "2.6",
        "2.0",
    )
    script.expect(event="ready")
    with agent:
        agent.expect(lambda agv: agv.state is not None and agv.pose is not None)
        yield agent
    script.close()


def test_its_virtual_agv_drives_picks_and_drops_under_our_agent(agent):
    agent.drive(5.0, 2.0)
    agent.expect_success()
    agent.handle(StepKind.PICK)
    agent.expect_success()
    assert agent.agv.state.loads
    agent.drive(5.0, 4.0)
    agent.expect_success()
    agent.handle(StepKind.PLACE)
    agent.expect_success()
    assert not agent.agv.state.loads


def test_its_virtual_agv_is_cancelled_by_our_agent_and_takes_another_goal(agent):
    agent.drive(8.0, 8.6)
    agent.expect(lambda agv: agv.state.driving)
    agent.drive(2.6, 3.5)
    agent.expect_success()


def test_its_virtual_agv_pauses_for_our_agent_and_goes_on(agent):
    agent.drive(5.0, 2.0)
    agent.expect(lambda agv: agv.state.driving)
    agent.call(lambda: agent.agv.pause(True))
    agent.expect(lambda agv: agv.state.paused and not agv.state.driving)
    agent.call(lambda: agent.agv.pause(False))
    agent.expect_success()


def test_its_virtual_agv_charges_for_our_agent_and_stops_for_a_drive(agent):
    agent.call(lambda: agent.agv.charge_if(True, time.monotonic()))
    agent.expect(lambda agv: agv.state.power_supply.charging)
    agent.drive(3.6, 2.0)
    agent.expect_success()
    assert not agent.agv.state.power_supply.charging
