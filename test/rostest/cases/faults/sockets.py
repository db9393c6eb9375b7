# SPDX-License-Identifier: BSD-3-Clause
"""Where the whole mixed fleet listens: broker, traffic planner, simulator, windows and all.

It runs in a network of its own with a loopback and another interface, as `./hive shell` starts it.
"""

import os
from pathlib import Path

import pytest
import rosgraph
from launching import Launches, sockets_of, wait_until_empty
from live_network import OFFICE, LiveNetwork, NoNetworkError

HIVE = Path(__file__).resolve().parents[4] / "hive"
LOOPBACK = {"127.0.0.1", "::1"}
BROKER = "mosquitto"
NODES = {
    "/blackboard",
    "/fleet_manager",
    "/map_server",
    "/robot_host_1",  # robot1 to robot3 with all their nodes
    "/rosout",
    "/simulated_agv",
    "/simulator",
    "/task_markers",
    "/traffic_planner",
    "/vda5050_agent",
}


@pytest.fixture(scope="module", autouse=True)
def network():
    """A network with two interfaces that nothing else is on."""
    try:
        network = LiveNetwork([])
    except NoNetworkError as error:
        pytest.skip(f"{error}")
    yield network
    network.end()


@pytest.fixture
def listeners(tmp_path, monkeypatch):
    """Return a function that starts the fleet in an environment and returns who listens where."""
    launches = Launches()
    monkeypatch.setenv("QT_QPA_PLATFORM", "offscreen")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setenv("HOME", str(tmp_path))  # journals

    def listen(uri, ip):
        monkeypatch.setenv("ROS_MASTER_URI", uri)
        if ip is None:
            monkeypatch.delenv("ROS_IP")
        else:
            monkeypatch.setenv("ROS_IP", ip)
        fleet = "roslaunch fleet_manager fleet_manager.launch fleet:=mixed rviz:=false"
        process = launches.run(str(HIVE), "shell", "-c", fleet)
        wait_until_empty(lambda: NODES - nodes(uri))
        wait_until_empty(lambda: {BROKER, "rosmaster"} - {name for name, _ in sockets_of(process)})
        return sockets_of(process)

    yield listen
    launches.stop()


def nodes(uri):
    """Return the nodes that a ROS master knows; none while it does not answer."""
    try:
        state = rosgraph.Master("/watcher", uri).getSystemState()
    except (OSError, rosgraph.MasterException):
        return set()
    return {node for kind in state for _, there in kind for node in there}


def test_by_default_nothing_of_a_whole_fleet_listens_beyond_this_machine(listeners):
    found = listeners("http://localhost:11311", None)

    assert {address for _, address in found} <= LOOPBACK, found


def test_with_an_interface_in_ros_ip_all_listen_there_only_and_the_broker_on_loopback(listeners):
    assert os.environ["ROS_IP"] != OFFICE
    found = listeners(f"http://{OFFICE}:11311", OFFICE)
    broker = {address for name, address in found if name == BROKER}

    assert {address for name, address in found if name != BROKER} == {OFFICE}, found
    assert broker <= LOOPBACK
