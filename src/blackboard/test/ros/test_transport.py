# SPDX-License-Identifier: BSD-3-Clause
"""Which transport a node gets by its parameter `zenoh`, and what it says over Zenoh."""

from types import SimpleNamespace

import pytest

pytest.importorskip("robot_description.msg", reason="needs generated messages")

import rospy

from blackboard.domain.talker import LEARNER_TOPICS, ROBOT_TOPICS, VOTER_TOPICS
from blackboard.errors import NoRouterError, SettingsError
from blackboard.process.talker import ProcessTalker
from blackboard.ros import drives as drives_module
from blackboard.ros import relay as relay_module
from blackboard.ros import transport
from blackboard.ros.transport import make_talker, zenoh_settings
from blackboard.zenoh import link as link_module
from blackboard.zenoh import opening as opening_module
from blackboard.zenoh.settings import ZenohSettings
from hive_common.errors import ParameterError

LISTEN = "tcp/127.0.0.1:7447"
STANDS_BY = (*VOTER_TOPICS, *ROBOT_TOPICS)
LEARNS = (*LEARNER_TOPICS, *ROBOT_TOPICS)


class FakeLink:
    """A link that notes what it was made with."""

    def __init__(self, session, hive, name, advertises, **options):
        self.session, self.hive, self.name = session, hive, name
        self.advertises, self.options = tuple(advertises), options

    def attach(self, inbox):
        self.inbox = inbox


class FakeRelay:
    """A relay that notes what it is to carry."""

    def __init__(self, session, own, namespace, refuse, ours):
        self.session, self.own, self.namespace, self.refuse = session, own, namespace, refuse
        self.ours = ours
        self.brought, self.taken, self.drives = {}, {}, []
        self.bring_in, self.take_out = self.brought.__setitem__, self.taken.__setitem__


class Node:
    """A node of machine `lab`, with its parameters and what was made for it."""

    def __init__(self, monkeypatch):
        self.parameters = {}
        self.name = "/lab/blackboard"
        self.configs, self.links, self.relays, self.at_exit = [], [], [], []
        self.at_shutdown, self.ros_talkers = [], []
        self.session = SimpleNamespace(close=lambda: None)
        self.silent, self.warnings, self.is_shut_down = 0, [], False
        monkeypatch.setattr(rospy, "has_param", self.parameters.__contains__)
        monkeypatch.setattr(rospy, "get_param", self._get)
        monkeypatch.setattr(rospy, "resolve_name", lambda name: name)
        monkeypatch.setattr(rospy, "get_name", lambda: self.name)
        monkeypatch.setattr(rospy, "get_time", lambda: 7.0)
        monkeypatch.setattr(rospy, "is_shutdown", lambda: self.is_shut_down)
        monkeypatch.setattr(rospy, "logwarn_throttle", lambda _, text: self.warnings.append(text))
        monkeypatch.setattr(rospy.rostime, "wallsleep", lambda _: None)
        monkeypatch.setattr(rospy, "on_shutdown", self.at_shutdown.append)
        monkeypatch.setattr(transport, "atexit", SimpleNamespace(register=self.at_exit.append))
        monkeypatch.setattr(transport, "RosTalker", self._make_ros_talker)
        monkeypatch.setattr(opening_module, "open_session", self._open)
        monkeypatch.setattr(link_module, "ZenohLink", self._noting(self.links, FakeLink))
        monkeypatch.setattr(relay_module, "Relay", self._noting(self.relays, FakeRelay))
        tell = lambda relay, *drive: relay.drives.append(drive)  # noqa: E731  (one line)
        monkeypatch.setattr(drives_module, "DriveTeller", tell)

    def _get(self, name, default=None):
        return self.parameters.get(name, default)

    def _open(self, config):
        self.configs.append(config)
        if len(self.configs) <= self.silent:
            raise NoRouterError("no router answers")
        return self.session

    def _make_ros_talker(self, *args):
        self.ros_talkers.append(args)
        return "a talker on ROS"

    @staticmethod
    def _noting(made, kind):
        def make(*args, **options):
            made.append(kind(*args, **options))
            return made[-1]

        return make


@pytest.fixture
def node(monkeypatch):
    return Node(monkeypatch)


@pytest.fixture
def on_zenoh(node):
    """A node whose parameter `zenoh` is set."""
    node.parameters["/lab/zenoh"] = {"listen": [LISTEN], "hive": "hall"}
    return node


def test_a_node_without_the_parameter_speaks_over_ros_also_for_several_robots(node):
    talker = make_talker("/lab/", {"robot1": LEARNS, "robot2": iter(STANDS_BY)})

    assert zenoh_settings("/lab/blackboard") is None
    assert talker == "a talker on ROS"
    ((hive, topics, robots),) = node.ros_talkers
    assert (hive, robots) == ("/lab/", ("robot1", "robot2"))
    assert sorted(topics) == sorted({*LEARNS, *STANDS_BY})
    assert node.configs == []


@pytest.mark.parametrize(
    "place", ["/lab/robot1/robot/zenoh", "/lab/robot1/zenoh", "/lab/zenoh", "/zenoh"]
)
def test_the_parameter_is_read_below_the_node_or_a_namespace_above_it(node, place):
    node.parameters[place] = {"listen": [LISTEN], "hive": "hall"}

    assert zenoh_settings("/lab/robot1/robot") == ZenohSettings(listen=(LISTEN,), hive="hall")
    assert (zenoh_settings("/hall/robot1/robot") is None) == (place != "/zenoh")
    assert node.configs == []


def test_what_is_nearer_to_the_node_goes_first(on_zenoh):
    on_zenoh.parameters["/lab/robot1/robot/zenoh"] = {"hive": "own"}

    found = zenoh_settings("/lab/robot1/robot")
    assert found is not None
    assert found.hive == "own"


def test_a_parameter_that_says_nothing_still_asks_for_zenoh(node):
    node.parameters["/lab/zenoh"] = {}

    assert zenoh_settings("/lab/blackboard") == ZenohSettings()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"mode": "router"}, "^/lab/zenoh: mode: 'router'; allowed: peer"),
        ({"listen": LISTEN}, "^/lab/zenoh: listen: '.*'; allowed: a list"),
        ("", "^/lab/zenoh: ''; allowed: the keys listen, connect"),
    ],
)
def test_a_wrong_value_is_named_with_its_parameter(node, given, said):
    node.parameters["/lab/zenoh"] = given

    with pytest.raises(ParameterError, match=said):
        make_talker("/lab/", {"robot1": STANDS_BY})
    assert node.configs == node.ros_talkers == []


@pytest.fixture
def of_two(node):
    """A node of a learner and a robot that stands by; each connects by a parameter of its own."""
    for port, robot in enumerate(("agv1", "agv2"), start=7447):
        listen = [f"tcp/127.0.0.1:{port}"]
        node.parameters[f"/lab/{robot}/robot/zenoh"] = {"listen": listen, "hive": "hall"}
    node.name = "/lab/vda5050_agent"
    return node


TWO = {"agv1": LEARNS, "agv2": STANDS_BY}


def test_each_robot_of_a_process_has_a_session_a_link_and_topics_of_its_own(of_two):
    talker = make_talker("/lab/", {robot: iter(topics) for robot, topics in TWO.items()})

    ports = [config["listen"]["endpoints"] for config in of_two.configs]
    assert ports == [["tcp/127.0.0.1:7447"], ["tcp/127.0.0.1:7448"]]
    assert {link.name: link.advertises for link in of_two.links} == TWO
    assert [link.options["among"] for link in of_two.links] == [("agv1", "agv2")] * 2
    assert [link.inbox for link in of_two.links] == [talker] * 2
    assert len(of_two.at_exit) == len(of_two.links)


def test_each_robot_of_a_process_announces_itself_and_one_brings_in_for_all(of_two):
    make_talker("/lab/", TWO)

    first, second = of_two.relays
    assert [set(first.taken), set(second.taken)] == [
        {"traffic"},
        {"traffic", "routes", "traffic_state"},
    ]
    assert [len(first.brought), len(second.brought)] == [4, 0]
    assert [relay.ours for relay in of_two.relays] == [("agv1", "agv2")] * 2
    assert [names.robot for relay in of_two.relays for names, _ in relay.drives] == list(TWO)
    assert [relay.own.name for relay in of_two.relays] == list(TWO)


def test_a_process_of_which_some_robots_only_speak_over_zenoh_does_not_start(of_two):
    with pytest.raises(SettingsError) as refused:
        make_talker("/lab/", TWO | {"agv3": LEARNS})

    assert str(refused.value) == (
        "the parameter zenoh is not set for agv3, but for other robots of this process; allowed: "
        "for all of them, or for none"
    )
    assert of_two.configs == []


def test_an_endpoint_that_reaches_others_without_certificates_is_refused(on_zenoh):
    on_zenoh.parameters["/lab/zenoh"] = {"listen": ["tcp/0.0.0.0:7447"]}

    with pytest.raises(SettingsError, match="allowed without certificates"):
        make_talker("/lab/", {"robot1": STANDS_BY})
    assert on_zenoh.configs == []


@pytest.mark.parametrize(
    ("spoken", "said"),
    [
        (({"robot1": STANDS_BY},), {"traffic", "routes", "traffic_state"}),
        (({"robot1": LEARNS},), {"traffic"}),
        (({}, VOTER_TOPICS), {"routes", "traffic_state"}),
        (({}, LEARNER_TOPICS), set()),
    ],
    ids=["a robot that stands by", "a learner", "the blackboard", "one that neither is nor leads"],
)
def test_a_relay_takes_out_what_its_process_may_say_and_brings_in_all(on_zenoh, spoken, said):
    make_talker("/lab/", *spoken)

    (relay,) = on_zenoh.relays
    assert relay.taken == {topic: relay.brought[topic] for topic in said}
    assert {topic: kind.__name__ for topic, kind in relay.brought.items()} == {
        "traffic": "Traffic",
        "routes": "Routes",
        "traffic_state": "TrafficState",
        "zone_command": "ZoneCommand",
    }


def test_a_robot_s_process_tells_where_it_is_and_drives(on_zenoh):
    make_talker("/lab/", {"robot1": STANDS_BY})
    make_talker("/lab/", {}, VOTER_TOPICS)

    robot, blackboard = on_zenoh.relays
    ((names, refuse),) = robot.drives
    assert names == ("/lab/", "robot1")
    assert refuse is not None
    assert blackboard.drives == []


def test_nothing_is_relayed_where_all_members_share_one_ros_master(on_zenoh):
    on_zenoh.parameters["/lab/zenoh"] = {"listen": [LISTEN], "own_master": False}

    talker = make_talker("/lab/", {"robot1": STANDS_BY})

    assert on_zenoh.links[0].inbox is talker
    assert on_zenoh.relays == []


def test_the_relay_belongs_to_the_same_process_and_tells_the_talker_what_it_refuses(
    on_zenoh, monkeypatch
):
    monkeypatch.setattr(ProcessTalker, "call", lambda _, action: action())
    talker = make_talker("/lab/", {"robot1": STANDS_BY})

    (relay,) = on_zenoh.relays
    relay.refuse("traffic", "too long")
    assert (relay.own.hive, relay.own.name, relay.namespace) == ("hall", "robot1", "/lab/")
    assert relay.session is on_zenoh.session
    assert talker.refusals.counts == {("traffic", "too long"): 1}


@pytest.mark.parametrize(
    ("spoken", "name"),
    [(({"robot1": iter(STANDS_BY)},), "robot1"), (({}, iter(STANDS_BY)), "blackboard")],
)
def test_a_process_speaks_as_its_robot_or_else_as_its_node(on_zenoh, spoken, name):
    make_talker("/lab/", *spoken)

    (link,) = on_zenoh.links
    assert (link.hive, link.name, link.session) == ("hall", name, on_zenoh.session)
    assert link.advertises == STANDS_BY
    assert link.options["namespace"] == "/lab/"
    assert link.options["among"] == ()
    assert link.options["address"] == "127.0.0.1:7447"
    assert link.options["date"]() == 7.0


def test_the_session_is_that_of_the_parameter_and_ends_with_the_process(on_zenoh):
    on_zenoh.parameters["/lab/zenoh"] = {"connect": [LISTEN], "mode": "client"}
    make_talker("/lab/", {"robot1": STANDS_BY})

    (config,) = on_zenoh.configs
    assert config["mode"] == "client"
    assert config["connect"]["endpoints"] == [LISTEN]
    assert on_zenoh.at_exit == [on_zenoh.session.close]


def test_a_node_waits_for_a_router_and_says_so(on_zenoh):
    on_zenoh.parameters["/lab/zenoh"] = {"connect": [LISTEN], "mode": "client"}
    on_zenoh.silent = 2

    make_talker("/lab/", {"robot1": STANDS_BY})

    assert on_zenoh.links[0].session is on_zenoh.session
    assert on_zenoh.warnings == ["no router answers"] * 2


def test_a_node_that_is_shut_down_waits_for_no_router(on_zenoh):
    on_zenoh.parameters["/lab/zenoh"] = {"connect": [LISTEN], "mode": "client"}
    on_zenoh.silent, on_zenoh.is_shut_down = 99, True

    with pytest.raises(rospy.ROSInterruptException):
        make_talker("/lab/", {"robot1": STANDS_BY})
    assert len(on_zenoh.configs) == 1


def test_a_node_whose_folder_is_not_there_does_not_start(on_zenoh, tmp_path):
    folder = tmp_path / "gone"
    on_zenoh.parameters["/lab/zenoh"] = {"certificates": str(folder)}

    with pytest.raises(SettingsError, match=r"gone/own\.json cannot be used"):
        make_talker("/lab/", {"robot1": STANDS_BY})
    assert on_zenoh.configs == []


def test_the_talker_uses_the_link_and_wakes_up_when_the_node_shuts_down(on_zenoh, monkeypatch):
    talker = make_talker("/lab/", {"robot1": STANDS_BY})
    assert isinstance(talker, ProcessTalker)
    assert on_zenoh.links[0].inbox is talker

    woken = []
    monkeypatch.setattr(talker, "call", woken.append)
    (wake,) = on_zenoh.at_shutdown
    wake()
    assert len(woken) == 1
