# SPDX-License-Identifier: BSD-3-Clause
"""Five machines, each with a ROS master and a simulator, started by the launch file.

They are hosts of a network on this computer: three with a robot each, one with two AGVs that speak
VDA 5050, and the office with the blackboard and the operator, which is this program's. They are
simulated apart, so nobody's laser sees another one: what keeps them from each other are
announcements and routes that cross the network.
"""

import contextlib
import json
import os
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
import psutil
import pytest
import rosgraph
import rospy
import yaml
from blackboard.msg import TaskState
from launching import Launches, hive_started, wait_until_empty
from live_network import OFFICE, network_of
from live_site import ALONE, NO_MASTER
from nav_msgs.msg import Path as PathMsg
from shapely import affinity
from shapely.geometry import Polygon

from blackboard.zenoh.access import Role
from fleet_manager.certs.site import Site
from hive_common.resources import find_file
from hive_lab.live.live_operator import LiveOperator
from hive_lab.runner.limits import PATIENCE
from robot_description.models import load_model

NODES = Path(__file__).resolve().parents[2] / "nodes"
FLEET = yaml.safe_load(find_file("fleet_manager", "fleets", "lab").read_text("utf-8"))
AGV = {"driver": "vda5050", "simulated": True}
FLEET["robots"][1] |= AGV
FLEET["robots"].append({"name": "agv1", "model": "mir100", "pose": [2.6, 8.0, 0.0], **AGV})
SCENARIO = yaml.safe_load(find_file("fleet_manager", "scenarios", "demo").read_text("utf-8"))
ROBOTS = tuple(robot["name"] for robot in FLEET["robots"])
TASKS = tuple(task["id"] for task in SCENARIO["tasks"])
AGVS = "agvs"
"""The host of all robots with `driver: vda5050`."""
HOSTS = {robot["name"]: AGVS if "driver" in robot else robot["name"] for robot in FLEET["robots"]}
"""Where each robot runs."""
MEMBERS = ("/blackboard", *(f"/{robot}/robot" for robot in ROBOTS))
IN_THE_OFFICE = ("blackboard", "laptop1")
PORTS = {robot: 7447 + number for number, robot in enumerate(ROBOTS)}
FOOTPRINTS = {
    robot["name"]: Polygon(load_model(robot["model"]).base.footprint) for robot in FLEET["robots"]
}


class Machines:
    """The hosts, what was launched on them, and what their witnesses have seen.

    Args:
        folder: For certificates, files, journals and logs.
        network: With the hosts of all robots; this program is in the office.
    """

    def __init__(self, folder, network):
        self._folder = folder
        self._network = network
        self._launched = {}
        self._launches = Launches()
        self.addresses = {
            robot: f"{network.address(HOSTS[robot])}:{PORTS[robot]}" for robot in ROBOTS
        }
        site = Site.new(folder / "site")
        site.add("blackboard", Role.BLACKBOARD)
        site.add("laptop1", Role.OPERATOR)
        for robot in ROBOTS:
            site.add(robot, Role.ROBOT)
        zenoh = {
            "members": [
                {"name": "blackboard", "address": f"{OFFICE}:{PORTS[ROBOTS[0]]}"},
                *({"name": robot, "address": self.addresses[robot]} for robot in ROBOTS),
            ],
            "certificates": str(site.folder / "members"),
            "operators": ["laptop1"],
        }
        self._fleet = _written(
            folder / "fleet.yaml", {**FLEET, "transport": "zenoh", "zenoh": zenoh}
        )
        self._scenario = _written(folder / "demo.yaml", {**SCENARIO, "time_limit": 10 * PATIENCE})

    def start(self):
        """Launch on each host what runs there."""
        self._launch("office", IN_THE_OFFICE)
        for host in set(HOSTS.values()):
            self._launch(host, tuple(robot for robot in ROBOTS if HOSTS[robot] == host))

    def _launch(self, host, names):
        words = {
            "fleet": self._fleet,
            "machine": " ".join(names),
            "gui": "false",
            "rviz": "false",
        }
        environment = {**ALONE, "ROS_HOME": str(self._folder / host)}
        self._launched[host] = self._launches.run(
            *self._prefix(host),
            "env",
            *(f"{name}={value}" for name, value in environment.items()),
            *("roslaunch", "fleet_manager", "fleet_manager.launch"),
            *(f"{name}:={value}" for name, value in words.items()),
        )

    def _prefix(self, host):
        return [] if host == "office" else self._network.prefix(host)

    @contextlib.contextmanager
    def witnessed(self):
        """Have a witness on each robot's host; yield a function that returns what all have told.

        It returns, for each robot, a list of what was told under each word.
        """
        files = {robot: self._folder / f"{robot}.jsonl" for robot in ROBOTS}
        with contextlib.ExitStack() as stack:
            for robot, file in files.items():
                words = [
                    *self._prefix(HOSTS[robot]),
                    sys.executable,
                    str(NODES / "witness"),
                    robot,
                ]
                log = stack.enter_context(file.open("w"))
                witness = subprocess.Popen(words, stdout=log, env={**os.environ, **ALONE})
                stack.enter_context(witness)
                stack.callback(witness.kill)
            wait_until_empty(lambda: [robot for robot in files if not _told(files[robot], "pose")])
            yield lambda word: {robot: _told(file, word) for robot, file in files.items()}

    def scenario_started(self):
        """Run the scenario as an operator does without a ROS master; see `hive_started`."""
        words = ("--connect", str(self._fleet), "run", str(self._scenario), "--wait")
        return hive_started(*words, **NO_MASTER)

    def kill_member(self, node):
        """Kill the process of a member alone."""
        host = "office" if node == "/blackboard" else HOSTS[node.split("/")[1]]
        program = {"office": "blackboard_node", AGVS: "vda5050_agent"}.get(host, "robot_node")
        below = psutil.Process(self._launched[host].pid).children(recursive=True)
        (member,) = (each for each in below if _runs(each, program))
        member.kill()

    def stop(self):
        """Stop all that was launched."""
        self._launches.stop()


def _written(path, content):
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def _told(file, word):
    """Return what a witness has told under a word; its last line may be unfinished."""
    lines = file.read_text("utf-8").split("\n")[:-1]
    return [line[word] for line in map(json.loads, lines) if word in line]


def _runs(process, program):
    try:
        return any(word.endswith(f"/{program}") for word in process.cmdline())
    except psutil.NoSuchProcess:
        return False


@pytest.fixture(scope="module")
def network():
    """The hosts of all robots."""
    with network_of(tuple(dict.fromkeys(HOSTS.values()))) as network:
        yield network


@pytest.fixture(scope="module")
def machines(network, tmp_path_factory):
    """The machines, with all that runs there."""
    machines = Machines(tmp_path_factory.mktemp("machines"), network)
    try:
        machines.start()
        yield machines
    finally:
        rospy.signal_shutdown("what follows ends the master")
        machines.stop()


@pytest.fixture(scope="module")
def operator(machines):  # noqa: ARG001  (its hive)
    """What is heard at the office's ROS master, which the gateway tells of the hive."""
    os.environ.update(ALONE)
    wait_until_empty(lambda: [] if rosgraph.is_master_online() else ["the office's ROS master"])
    rospy.init_node("operator", disable_signals=True)
    operator = LiveOperator("/", MEMBERS)
    operator.wait_until_whole()
    operator.demand(lambda: set(operator.robots) == set(ROBOTS), "a status of every robot")
    return operator


def test_the_demo_is_done_without_a_collision_though_its_leader_is_killed(machines, operator):
    drawn = follow_paths()
    with machines.witnessed() as told, machines.scenario_started() as scenario:
        operator.demand(lambda: operator.updates[TASKS[8]], "more than half of the tasks")
        routes = {epoch for heard in told("follows").values() for _, epoch in heard}
        since, leader = time.monotonic(), operator.last.active
        machines.kill_member(leader)
        operator.wait_for_another(leader, since)
        for task in TASKS:
            assert operator.follow(task) == TaskState.DONE, task
        _, said = scenario.communicate(timeout=PATIENCE)
        heard, contacts, poses = told("follows"), told("contacts"), told("pose")

    assert scenario.returncode == 0, said
    assert routes - {0}, "no robot followed a route before the leader was killed"
    assert contacts == {robot: [0] for robot in ROBOTS}
    assert {operator.updates[task][-1].robot_id for task in TASKS} <= drawn
    for robot, announced in heard.items():
        assert {name for name, _ in announced} == set(ROBOTS), f"announced at {robot}"
        later = {name for name, epoch in announced if epoch > max(routes)}
        assert len(later) > 1, f"at {robot}, the next planner's routes are followed by {later}"
    for number, one in enumerate(ROBOTS):
        for other in ROBOTS[number + 1 :]:
            assert overlaps(one, poses[one], other, poses[other]) == []
    assert logs_with("Traceback") == []


@pytest.mark.usefixtures("operator")
def test_nothing_but_the_hive_s_port_is_reached_from_the_network(network, machines):
    expected = defaultdict(set)
    for robot, host in HOSTS.items():
        expected[host].add(machines.addresses[robot])
    assert {host: network.open_on(host) for host in expected} == expected


def follow_paths():
    """Return the robots of which a path comes to the office, now and later."""
    drawn = set()

    def note(path, robot):
        if path.poses:
            drawn.add(robot)

    for robot in ROBOTS:
        rospy.Subscriber(f"/{robot}/move_base/plan", PathMsg, note, robot)
    return drawn


def overlaps(one, poses, other, others):
    """Return when the footprints of two robots overlap, by their poses, each with its time [s]."""
    track = np.array(others)
    yaws = np.unwrap(track[:, 3])
    found = []
    for time_, *pose in poses:
        columns = (track[:, 1], track[:, 2], yaws)
        there = [np.interp(time_, track[:, 0], column) for column in columns]
        if footprint(one, *pose).intersects(footprint(other, *there)):
            found.append(time_)
    return found


def logs_with(word):
    """Return the logs of members that have a word."""
    logs = [
        log
        for name in ("blackboard", "robot?-robot", "vda5050_agent")
        for log in Path(os.environ["ROS_LOG_DIR"]).rglob(f"{name}-*.log")
    ]
    assert len(logs) == len({"office", *HOSTS.values()})
    return [str(each) for each in logs if word in each.read_text("utf-8", "replace")]


def footprint(robot, x, y, yaw):
    """Return the ground that a robot covers at a pose [m, m, rad]."""
    turned = affinity.rotate(FOOTPRINTS[robot], yaw, origin=(0, 0), use_radians=True)
    return affinity.translate(turned, x, y)
