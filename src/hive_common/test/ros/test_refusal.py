# SPDX-License-Identifier: BSD-3-Clause
"""Why nodes refused to start, as windows and commands find it."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from hive_common.ros.refusal import PARAMETER, forget_refusal, refusals, refuse_to_start


class Server:
    """The parameters of a ROS master, or one that does not answer."""

    def __init__(self):
        self.known = {}
        self.is_up = True

    def _ask(self):
        if not self.is_up:
            raise ConnectionRefusedError

    def set(self, name, value):
        self._ask()
        self.known[name] = value

    def has(self, name):
        self._ask()
        return name in self.known

    def delete(self, name):
        del self.known[name]

    def get(self, name, default):
        self._ask()
        tree = {}
        for full, value in self.known.items():
            *above, last = full.removeprefix(f"{name}/").split("/")
            node = tree
            for each in above:
                node = node.setdefault(each, {})
            node[last] = value
        return tree or default


@pytest.fixture
def server(monkeypatch):
    server = Server()
    monkeypatch.setattr(rospy, "get_name", lambda: "/robot1/robot")
    monkeypatch.setattr(rospy, "logfatal", lambda _text: None)
    for name in ("set_param", "has_param", "delete_param", "get_param"):
        monkeypatch.setattr(rospy, name, getattr(server, name.removesuffix("_param")))
    return server


@pytest.mark.usefixtures("server")
def test_what_a_node_refuses_is_found_by_its_name_until_it_starts_again():
    refuse_to_start("charge is 5; allowed: 0 to 1")
    refuse_to_start("no such model", node="/robot2")
    assert refusals() == {
        "robot1/robot": "charge is 5; allowed: 0 to 1",
        "robot2": "no such model",
    }

    forget_refusal()
    assert refusals() == {"robot2": "no such model"}


def test_other_values_below_the_parameter_are_no_refusals(server):
    server.set(f"{PARAMETER}/robot1", 7)

    assert refusals() == {}


def test_without_a_master_nothing_is_kept_and_nothing_breaks(server):
    server.is_up = False

    refuse_to_start("no such model")
    forget_refusal()

    assert refusals() == {}
