# SPDX-License-Identifier: BSD-3-Clause
"""A hive whose members are on hosts of their own, each with a ROS master that only it reaches.

What the members say crosses the network over Zenoh, with certificates.
"""

import contextlib
import json
import os
import subprocess
import sys

import rospy
from blackboard.msg import TaskState
from launching import hive_started, run_hive, wait_until_empty

from blackboard.zenoh.access import Role
from fleet_manager.certs.site import Site
from fleet_manager.config.zenoh_launch import connection_of
from hive_common.resources import node_file
from hive_lab.live.live_hive import LiveHive, own_master
from hive_lab.live.live_operator import LiveOperator, make_task
from hive_lab.live.site_file import router_command, write_fleet

MASTER = "http://127.0.0.1:11311"
PORT = 7447
ALONE = {"ROS_MASTER_URI": MASTER, "ROS_IP": "127.0.0.1"}
"""A process that only its own host reaches, by ROS."""

NO_MASTER = {"ROS_MASTER_URI": "http://127.0.0.1:9"}
"""A process that no ROS master answers."""

GATEWAY, OPERATOR = "/hive_gateway", "laptop"
"""The operator's node, and whose certificate it has."""

DRIVE = 0.5
"""Duration of each drive [s, wall clock]."""

_MASTER = """
import json, signal, rosgraph, sys
from rosmaster.master import Master
master = Master(11311)
master.start()
for name, value in json.loads(sys.argv[1]).items():
    rosgraph.Master("/master").setParam(name, value)
print("ready", flush=True)
signal.pause()
"""
"""A ROS master with parameters."""

_TRAFFIC = """
import sys, rospy
from robot_description.msg import Traffic
rospy.init_node("traffic")
ear = rospy.Subscriber("/traffic", Traffic, lambda msg: print(msg.waits_for, flush=True))
mouth = rospy.Publisher("/traffic", Traffic, queue_size=10)
for line in sys.stdin:
    if line == "links\\n":
        print(min(ear.get_num_connections(), mouth.get_num_connections()), flush=True)
        continue
    msg = Traffic(name=sys.argv[1], waits_for=line.strip())
    msg.header.stamp = rospy.Time.now()
    mouth.publish(msg)
"""
"""Announces on `traffic` that a robot waits for another one, whose name it reads, and prints for
whom robots wait. Asked for its links, it prints how many it has in each direction."""


class LiveSite(LiveHive):
    """The processes of the hive: a master, a member, and for a robot a fake base on each host.

    The program that makes it is the operator's: it needs a master of its own, on the office's
    loopback.

    Args:
        folder: For certificates, journals and logs.
        network: With a host for each member, by the name of its robot; `blackboard` for the node
            that has none.
        drive: Duration of each drive [s].
        strangers: Who else has a certificate: roles by names.
        routers: Hosts that run a router, with those who connect to it first; if there are none,
            members connect to each other.
        further: As those of `LiveHive`.

    Attributes:
        certificates: The site's authority.
        routers: Names of the routers' hosts.
    """

    def __init__(self, folder, network, drive, strangers=None, routers=None, **further):
        self._network = network
        self._drive = drive
        self._more = {}
        self.certificates = Site.new(folder / "site")
        self.routers = tuple(routers or ())
        super().__init__(folder, **further)
        self.certificates.add("blackboard", Role.BLACKBOARD)
        for robot in self.robots:
            self.certificates.add(robot, Role.ROBOT)
        self.certificates.add(OPERATOR, Role.OPERATOR)
        for name, role in (strangers or {}).items():
            self.certificates.add(name, role)
        for router in self.routers:
            self.certificates.add(router, Role.ROUTER)
        members = [{"name": each, "address": self.address_of(each)} for each in self.hosts]
        connected = [
            {"name": each, "address": self.address_of(each), "serves": list(served)}
            for each, served in (routers or {}).items()
        ]
        zenoh = {
            "certificates": str(self.certificates.folder / "members"),
            "operators": [OPERATOR],
            **({"routers": connected} if routers else {"members": members}),
        }
        self._fleet = write_fleet(folder / "fleet.yaml", self.robots, zenoh)

    @property
    def hosts(self):
        """Names of the members' hosts."""
        return tuple(self.robot_of(node) or "blackboard" for node in self.members)

    def host_of(self, node):
        """Return the host of a member."""
        return self.robot_of(node) or "blackboard"

    def node_on(self, host):
        """Return the member on a host."""
        return self.blackboard if host == "blackboard" else self.node_of(host)

    def set_parameters(self):
        """Set nothing here: each host's master gets its parameters when it is started."""

    def parameters_of(self, host):
        """Return the parameters on a host's master."""
        return {**self._parameters, "/zenoh": connection_of(self._fleet, host)}

    @property
    def endpoints(self):
        """Where all members are reached, as Zenoh writes it."""
        return tuple(f"tls/{self.address_of(host)}" for host in self.hosts)

    def operator_parameters(self):
        """Return the parameter `zenoh` of the operator's gateway."""
        return connection_of(self._fleet, OPERATOR)

    def start_all(self):
        """Start every host, and the operator's gateway."""
        for router in self.routers:
            self.start_router(router)
        for node in self.members:
            self.start_host(self.host_of(node))
        self.start_gateway()

    def start_gateway(self):
        """Start the operator's gateway."""
        gateway = (sys.executable, str(node_file("fleet_manager", "hive_gateway")))
        self.start(GATEWAY, program=gateway)

    def start_router(self, host):
        """Start the router of a host, as an operator does."""
        program = router_command(self._fleet, host)
        self.start(router_of(host), program=program, prefix=self._network.prefix(host))

    def start_host(self, host):
        """Start a host's master, its base and its member."""
        prefix = self._network.prefix(host)
        environment = {**os.environ, **ALONE}
        parameters = json.dumps(self.parameters_of(host))
        master = [*prefix, sys.executable, "-c", _MASTER, parameters]
        self._more[f"{host} master"] = started = subprocess.Popen(
            master, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, env=environment
        )
        assert started.stdout.readline() == "ready\n"
        if host != "blackboard":
            base = [sys.executable, "-m", "hive_lab.live.fake_base", f"/{host}"]
            words = [f"{self._drive}", f"{self.robots.index(host)}"]
            self._run(f"{host} base", [*prefix, *base, *words], environment)
        self.start(self.node_on(host), prefix=prefix, environment=ALONE)

    @contextlib.contextmanager
    def traffic_on(self, host):
        """Run a node on a robot's host that hears and says on `traffic` who is waited for."""
        words = [*self._network.prefix(host), sys.executable, "-c", _TRAFFIC, host]
        pipe = subprocess.PIPE
        with subprocess.Popen(
            words, stdin=pipe, stdout=pipe, text=True, env={**os.environ, **ALONE}
        ) as node:
            try:
                wait_until_empty(lambda: _unlinked(node))
                yield node
            finally:
                node.kill()

    def kill_host(self, host):
        """Kill all that runs on a host."""
        for name in (f"{host} base", f"{host} master"):
            if name in self._more:
                self._more[name].kill()
                self._more[name].wait()
        self.kill(self.node_on(host))

    def hive(self, *words):
        """Run `hive` as the operator does without a ROS master; return the finished process."""
        return run_hive("--connect", str(self._fleet.path), *words, **NO_MASTER)

    def hive_started(self, *words):
        """Do the same without waiting for it; see `launching.hive_started`."""
        return hive_started("--connect", str(self._fleet.path), *words, **NO_MASTER)

    def address_of(self, host):
        """Return where a host's member or router is reached."""
        return f"{self._network.address(host)}:{PORT}"

    def end(self):
        """Kill everything."""
        super().end()
        for each in self._more.values():
            each.kill()
            each.wait()

    def _run(self, name, command, environment):
        log = (self._folder / f"{name.replace(' ', '-')}.log").open("ab")
        with log:
            self._more[name] = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=environment
            )


def router_of(host):
    """Return the name of the process of a host's router."""
    return f"/router_{host}"


@contextlib.contextmanager
def site_on(network, node, folders, **further):
    """Run a site, with its operator's program in this process as a node; see `LiveSite`."""
    os.environ.update(ALONE)
    with own_master(folders.mktemp("master")):
        rospy.init_node(node, anonymous=True, disable_signals=True)
        site = LiveSite(folders.mktemp("hive"), network, DRIVE, **further)
        rospy.set_param("/zenoh", site.operator_parameters())
        site.operator = LiveOperator(site.namespace, site.members)
        try:
            site.start_all()
            yield site
        finally:
            site.end()
            rospy.signal_shutdown("what follows ends the master")


def post(operator, word, count):
    """Post tasks, and return their ids."""
    tasks = [make_task(f"{word}-{x}", (float(x), 1.0)) for x in range(count)]
    for task in tasks:
        operator.post(task)
    return [task.id for task in tasks]


def doers(operator, tasks):
    """Return who has done tasks, once all are done, each under one assignment."""
    operator.demand(
        lambda: all(operator.state_of(task) == TaskState.DONE for task in tasks),
        "all tasks are done",
    )
    by = set()
    for task in tasks:
        listed = operator.record_of(task)
        told = [each for each in operator.updates[task] if each.state == TaskState.DONE]
        # The robot tells it, and the leader too; who is cut off misses both, and gets the list.
        done = {(each.robot_id, each.assignment) for each in told}
        ((robot, _),) = done | {(listed.robot, listed.assignment)}
        by.add(robot)
    return by


def _unlinked(node):
    """Return what keeps a node of `_TRAFFIC` from hearing its member and being heard."""
    print("links", file=node.stdin, flush=True)
    links = int(node.stdout.readline())
    return "" if links == 2 else f"{links} links of 2, its own and the member's"
