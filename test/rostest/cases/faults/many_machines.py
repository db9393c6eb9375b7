# SPDX-License-Identifier: BSD-3-Clause
"""What happens to a hive on several machines, each with a ROS master of its own, over Zenoh.

The operator is in the office: this program, the gateway, and a master of their own.
"""

import os

import pytest
import rospy
from blackboard.msg import TaskState
from live_network import LiveNetwork, NoNetworkError
from live_site import ALONE, LiveSite, is_local

from hive_lab.live.live_hive import own_master
from hive_lab.live.live_operator import LiveOperator, make_task

ROBOTS = ("robot1", "robot2", "robot3", "robot4")
HOSTS = ("blackboard", *ROBOTS)
DRIVE = 0.5
"""Duration of each drive [s, wall clock]."""


@pytest.fixture(scope="session")
def network():
    """A host for each member."""
    try:
        network = LiveNetwork(HOSTS)
    except NoNetworkError as error:
        pytest.skip(f"{error}")
    try:
        yield network
    finally:
        network.end()


@pytest.fixture(scope="session")
def site(network, tmp_path_factory):
    """A hive whose members share no ROS master."""
    os.environ.update(ALONE)
    with own_master(tmp_path_factory.mktemp("master")):
        rospy.init_node("many_machines", anonymous=True, disable_signals=True)
        site = LiveSite(tmp_path_factory.mktemp("hive"), network, DRIVE, robots=ROBOTS)
        rospy.set_param("/zenoh", site.operator_parameters())
        site.operator = LiveOperator(site.namespace, site.members)
        try:
            site.start_all()
            yield site
        finally:
            site.end()
            rospy.signal_shutdown("what follows ends the master")


@pytest.fixture
def operator(site, network):
    """The hive's operator, once the hive is complete."""
    site.operator.wait_until_whole()
    yield site.operator
    site.operator.forget_answers()
    network.heal()


def post(operator, word, count):
    """Post tasks, and return their ids."""
    tasks = [make_task(f"{word}-{x}", (float(x), 1.0)) for x in range(count)]
    for task in tasks:
        operator.post(task)
    return [task.id for task in tasks]


def doers(operator, tasks):
    """Return the robots that have done tasks, once each is done, by one robot and once."""
    operator.demand(
        lambda: all(operator.state_of(task) == TaskState.DONE for task in tasks),
        "all tasks are done",
    )
    by = {}
    for task in tasks:
        done = {each.robot_id for each in operator.updates[task] if each.state == TaskState.DONE}
        (by[task],) = done
    return set(by.values())


def test_tasks_that_are_posted_at_the_gateway_are_done(operator):
    tasks = post(operator, "gateway", 8)

    assert len(doers(operator, tasks)) > 1


@pytest.mark.usefixtures("operator")
def test_nothing_but_the_hive_s_port_is_reached_from_the_network(site):
    open_ports = {
        host: {each for each in site.listening_on(host) if not is_local(each)} for host in HOSTS
    }

    assert open_ports == {host: {site.address_of(host)} for host in HOSTS}
