# SPDX-License-Identifier: BSD-3-Clause
"""What happens to a hive in two halls, whose members connect to the router of their hall.

Each member has a host and a ROS master of its own, and each router a host. The operator is in the
office, which hears both halls.
"""

import time
from itertools import pairwise

import pytest
from live_network import network_of
from live_site import GATEWAY, OPERATOR, doers, post, router_of, site_on

ROBOTS = ("robot1", "robot2", "robot3", "robot4")
NORTH, SOUTH = "north", "south"
SERVED = {NORTH: ("blackboard", "robot1", "robot2", OPERATOR), SOUTH: ("robot3", "robot4")}
HALLS = (
    (NORTH, "blackboard", "robot1", "robot2"),
    (SOUTH, "robot3", "robot4"),
)
CUT = 14.0
"""Longer than Zenoh keeps a silent connection [s]."""


@pytest.fixture(scope="session")
def network():
    """A host for each member and each router."""
    with network_of([host for hall in HALLS for host in hall]) as network:
        yield network


@pytest.fixture(scope="session")
def site(network, tmp_path_factory):
    """A hive whose members share no ROS master, and reach each other by routers only."""
    with site_on(network, "two_halls", tmp_path_factory, robots=ROBOTS, routers=SERVED) as site:
        yield site


@pytest.fixture
def operator(site, network):
    """The hive's operator, once the hive is complete."""
    site.operator.wait_until_whole()
    yield site.operator
    site.operator.forget_answers()
    network.heal()


def test_robots_of_both_halls_do_what_is_posted(operator):
    by = doers(operator, post(operator, "both", 12))

    assert all(by & set(hall) for hall in HALLS), by


@pytest.mark.usefixtures("operator")
def test_nothing_but_the_routers_ports_is_reached_from_the_network(site, network):
    hosts = [host for hall in HALLS for host in hall]

    assert {host: network.open_on(host) for host in hosts} == {
        host: {site.address_of(host)} if host in SERVED else set() for host in hosts
    }


def test_another_member_takes_over_when_the_leader_s_host_is_killed(
    site, operator, record_property
):
    leader = operator.wait_until_whole()
    host = site.host_of(leader)
    tasks = post(operator, "killed", 8)

    since = time.monotonic()
    site.kill_host(host)

    record_property("takeover [s]", operator.wait_for_another(leader, since))
    doers(operator, tasks)
    operator.forget_answers()
    site.start_host(host)


def test_the_larger_hall_goes_on_without_the_other_and_both_are_one_hive_again_afterwards(
    network, operator
):
    network.split(*HALLS)
    operator.demand(
        lambda: {"robot3", "robot4"} <= set(operator.last.offline), "the other hall is offline"
    )
    tasks = post(operator, "split", 4)
    assert doers(operator, tasks) <= {"robot1", "robot2"}
    operator.pass_time(CUT)
    operator.forget_answers()
    network.heal()

    operator.wait_until_whole()
    doers(operator, post(operator, "healed", 4))


def silence(operator, since):
    """Return the longest time without a heartbeat at the operator's machine [s]."""
    heard = [since, *(at for at, _ in operator.beats if at > since)]
    return max(later - earlier for earlier, later in pairwise(heard))


@pytest.fixture
def all_at_north(site, operator):
    """Everyone is connected to the router of one hall, because that of the other was away."""
    site.kill(router_of(SOUTH))
    operator.forget_answers()
    operator.wait_until_whole()
    site.start_router(SOUTH)


@pytest.mark.usefixtures("all_at_north")
def test_members_whose_router_is_killed_use_another_one(site, operator, record_property):
    tasks = post(operator, "killed-router", 12)

    since = time.monotonic()
    site.kill(router_of(NORTH))
    doers(operator, tasks)
    operator.forget_answers()
    operator.wait_until_whole()
    record_property("silence [s]", silence(operator, since))

    site.start_router(NORTH)
    doers(operator, post(operator, "started-again", 4))


@pytest.mark.usefixtures("all_at_north")
def test_members_whose_router_hangs_use_another_one(site, operator, record_property):
    tasks = post(operator, "hanging-router", 12)

    since = time.monotonic()
    site.freeze(router_of(NORTH))
    try:
        doers(operator, tasks)
        operator.forget_answers()
        operator.wait_until_whole()
    finally:
        site.thaw(router_of(NORTH))
    record_property("silence [s]", silence(operator, since))

    doers(operator, post(operator, "thawed", 4))


@pytest.mark.usefixtures("all_at_north")
def test_members_whose_router_s_host_vanishes_use_another_one(network, operator, record_property):
    tasks = post(operator, "vanished-router", 12)

    since = time.monotonic()
    network.unplug(NORTH)
    doers(operator, tasks)
    operator.forget_answers()
    operator.wait_until_whole()
    record_property("silence [s]", silence(operator, since))
    network.heal()

    doers(operator, post(operator, "back", 4))


def test_the_operator_s_machine_reaches_the_hive_by_a_router_that_is_left(site, operator):
    for hall in (SOUTH, NORTH):
        site.kill(router_of(hall))
    site.kill(GATEWAY)
    site.start_gateway()  # waits for a router
    alone = site.hive("tasks")
    site.start_router(SOUTH)
    operator.forget_answers()

    operator.wait_until_whole()
    assert alone.returncode == 3
    assert "no router answers" in alone.stderr
    added = site.hive("add", "GA", "--goal", "3,1", "--id", "by-hand", "--wait")
    assert added.returncode == 0, added.stderr
    assert doers(operator, ["by-hand"])
    doers(operator, post(operator, "by-south", 4))
    site.start_router(NORTH)
