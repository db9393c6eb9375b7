# SPDX-License-Identifier: BSD-3-Clause
"""Why nodes refused to start, as windows and commands find it."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from hive_common.ros.refusal import PARAMETER, forget_refusal, refusals, refuse_to_start


class Server:
    """The parameters of a ROS master, or one that does not answer."""

    def __init__(self):
        self._tree = {}
        self.is_up = True

    def set(self, name, value):
        """Set a value; as in a ROS master, a value on the way to it makes room for a branch."""
        *above, last = self._keys(name)
        branch = self._tree
        for key in above:
            if not isinstance(branch.get(key), dict):
                branch[key] = {}
            branch = branch[key]
        branch[last] = value

    def has(self, name):
        return self.get(name, self) is not self

    def delete(self, name):
        above, _, last = name.rpartition("/")
        del self.get(above, None)[last]

    def get(self, name, default):
        found = self._tree
        for key in self._keys(name):
            if not isinstance(found, dict) or key not in found:
                return default
            found = found[key]
        return found

    def _keys(self, name):
        if not self.is_up:
            raise ConnectionRefusedError
        return name.strip("/").split("/")


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


@pytest.mark.usefixtures("server")
def test_a_robot_and_its_nodes_refuse_and_start_without_regard_to_each_other():
    refuse_to_start("outside the world", node="/robot1")
    refuse_to_start("charge is 5; allowed: 0 to 1")
    refuse_to_start("no map", node="/robot1/amcl")
    assert refusals() == {
        "robot1": "outside the world",
        "robot1/amcl": "no map",
        "robot1/robot": "charge is 5; allowed: 0 to 1",
    }

    forget_refusal("/robot1")
    assert set(refusals()) == {"robot1/amcl", "robot1/robot"}


@pytest.mark.parametrize("value", [7, "text", {"reason": 7}, [1]])
def test_other_values_below_the_parameter_are_no_refusals(server, value):
    server.set(f"{PARAMETER}/robot1", value)

    assert refusals() == {}


def test_without_a_master_nothing_is_kept_and_nothing_breaks(server):
    server.is_up = False

    refuse_to_start("no such model")
    forget_refusal()

    assert refusals() == {}
