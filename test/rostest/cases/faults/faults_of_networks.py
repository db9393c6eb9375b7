# SPDX-License-Identifier: BSD-3-Clause
"""What happens to a hive on several hosts when the network between them is cut or loses packets.

The office, where the ROS master and the operator are, hears both sides of a split, so that two
active blackboards at once would be seen.
"""

import os
import subprocess
import sys
import time
from collections import defaultdict
from itertools import pairwise

import pytest
import rospy
from blackboard.msg import TaskState
from live_network import OFFICE, LiveNetwork, NoNetworkError

from hive_lab.live.live_hive import LiveHive, own_master
from hive_lab.live.live_operator import LiveOperator, make_task

ROBOTS = ("robot1", "robot2", "robot3", "robot4")
HOSTS = ("blackboard", *ROBOTS)
TAKEOVER = 3.5
"""Time for another member to take over without a proven death [s]."""
DRIVE = 2.0
"""Duration of each drive [s]; less than a robot works on unheard."""
CUTS = 5
"""Number of times a bad cable loses contact."""
LOST = 8.0
"""Longer than the silence of a lost robot [s]."""


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
def hive(network, tmp_path_factory):
    """A hive whose members are on hosts of their own, and which waits for lost robots."""
    os.environ.update(ROS_MASTER_URI=f"http://{OFFICE}:11311", ROS_IP=OFFICE)
    bases = []
    with own_master(tmp_path_factory.mktemp("master")):
        rospy.init_node("faults", anonymous=True, disable_signals=True)
        folder = tmp_path_factory.mktemp("hive")
        hive = LiveHive(folder, "/networks/", ROBOTS, blackboard={"on_robot_lost": "wait"})
        hive.network = network
        hive.operator = LiveOperator(hive.namespace, hive.members)
        try:
            for x, name in enumerate(ROBOTS):
                bases.append(start_base(network, name, float(x)))
            for node in hive.members:
                host = host_of(hive, node)
                where = {"ROS_IP": network.address(host)}
                hive.start(node, prefix=network.prefix(host), environment=where)
            yield hive
        finally:
            hive.end()
            for base in bases:
                base.kill()
                base.wait()
            rospy.signal_shutdown("what follows ends the master")


@pytest.fixture
def operator(hive):
    """The hive's operator, once the hive is complete."""
    hive.operator.wait_until_whole()
    yield hive.operator
    hive.operator.forget_answers()
    hive.network.heal()


def start_base(network, robot, x):
    """Start a robot's fake base, on the robot's own host."""
    base = [
        sys.executable,
        "-m",
        "hive_lab.live.fake_base",
        f"/networks/{robot}",
        f"{DRIVE}",
        f"{x}",
    ]
    where = {**os.environ, "ROS_IP": network.address(robot)}
    return subprocess.Popen([*network.prefix(robot), *base], env=where)


def host_of(hive, node):
    return hive.robot_of(node) or "blackboard"


def followers(hive, operator):
    """Return the hosts of members that are neither leader nor backup."""
    leading = {operator.last.active, operator.last.backup}
    return [host_of(hive, node) for node in hive.members if node not in leading]


def reigns(operator, since):
    """Return the first and last heartbeat of each epoch's leader [s], in order of epochs.

    All hosts share the machine's clock. Arrival times say less: a healed network delivers
    messages that were sent long before.
    """
    spoke = defaultdict(list)
    for _, beat in operator.beats:
        if beat.sent > since:
            spoke[beat.epoch].append(beat.sent)
    return [(epoch, min(times), max(times)) for epoch, times in sorted(spoke.items())]


def overlaps(operator, since):
    """Return the pairs of epochs with two leaders at the same time."""
    spans = reigns(operator, since)
    return [(a[0], b[0]) for a, b in pairwise(spans) if a[2] >= b[1]]


def starters(operator, task_id):
    return [u.robot_id for u in operator.updates[task_id] if u.state == TaskState.STARTED]


def is_done(operator, task_id):
    answer = operator.post(make_task(task_id, (1.0, 1.0)))
    return answer.state == TaskState.WAITING and operator.follow(task_id) == TaskState.DONE


def test_an_active_one_that_is_split_off_steps_down_before_another_takes_over(hive, operator):
    active = operator.last.active
    minority = [host_of(hive, active), followers(hive, operator)[0]]
    since = time.monotonic()
    hive.network.split(minority, [host for host in HOSTS if host not in minority])
    cut = time.monotonic()
    gap = since + operator.wait_for_another(active, since) - cut
    worked = is_done(operator, "split")
    hive.network.heal()
    operator.wait_until_whole()

    assert gap < TAKEOVER
    assert worked
    assert overlaps(operator, since) == []


def test_where_no_group_is_a_majority_nobody_is_active_and_tasks_wait(hive, operator):
    since = time.monotonic()
    hive.network.split(HOSTS[:2], HOSTS[2:4], HOSTS[4:])
    operator.wait(lambda: time.monotonic() - operator.beats[-1][0] > TAKEOVER, 4 * TAKEOVER)
    silent = time.monotonic() - operator.beats[-1][0] > TAKEOVER
    operator.post_once(make_task("threefold", (2.0, 1.0)))
    unanswered = not operator.wait(lambda: operator.updates["threefold"], 2.0)
    hive.network.heal()

    assert silent
    assert unanswered
    assert is_done(operator, "threefold")
    assert overlaps(operator, since) == []


def test_a_robot_that_is_split_off_from_the_majority_changes_nothing(hive, operator):
    epoch = operator.last.epoch
    lonely = followers(hive, operator)[0]
    hive.network.split([lonely], [host for host in HOSTS if host != lonely])
    operator.pass_time(LOST)
    worked = is_done(operator, "majority")
    hive.network.heal()
    operator.wait_until_whole()

    assert worked
    assert operator.last.epoch == epoch


def test_an_active_one_that_hears_nobody_steps_down_and_elections_end(hive, operator):
    active, epoch = operator.last.active, operator.last.epoch
    since = time.monotonic()
    hive.network.deafen(host_of(hive, active))
    gap = operator.wait_for_another(active, since)
    operator.pass_time(LOST)

    assert gap < 2 * TAKEOVER
    assert overlaps(operator, since) == []
    # An election in which nobody gets a majority takes an epoch as well, but nobody speaks in it.
    assert len({beat.epoch for _, beat in operator.beats if beat.epoch > epoch}) <= 2
    assert is_done(operator, "deaf")


def test_a_host_that_vanishes_is_replaced_and_comes_back_as_a_follower(hive, operator):
    active, epoch = operator.last.active, operator.last.epoch
    since = time.monotonic()
    hive.network.unplug(host_of(hive, active))
    gap = operator.wait_for_another(active, since)
    worked = is_done(operator, "vanished")
    back = time.monotonic()
    hive.network.heal()
    operator.wait_until_whole()

    assert gap < TAKEOVER
    assert worked
    assert all(beat.epoch > epoch for _, beat in operator.beats if beat.sent > back)


def test_a_robot_that_arrives_while_it_is_cut_off_is_believed_and_nobody_drives_again(
    hive, operator
):
    lonely = followers(hive, operator)[0]
    x = float(ROBOTS.index(lonely)) if lonely in ROBOTS else 0.0
    for number in range(5):
        task = f"alone{number}"
        operator.post(make_task(task, (x, 0.5 + number)))
        operator.demand(lambda: operator.state_of(task) >= TaskState.STARTED, "it is begun")  # noqa: B023  (called at once)
        robot = operator.record_of(task).robot
        hive.network.unplug(robot)
        operator.pass_time(LOST)
        unheard = operator.state_of(task)
        hive.network.heal()

        assert operator.follow(task) == TaskState.DONE
        assert set(starters(operator, task)) == {robot}
        if unheard == TaskState.STARTED:
            return
        operator.wait_until_whole()
    pytest.fail("every time it arrived before it was cut off")


def test_a_cable_that_comes_and_goes_costs_few_takeovers(hive, operator):
    active = operator.last.active
    flapping = host_of(hive, active)
    since = time.monotonic()
    for _ in range(CUTS):
        hive.network.unplug(flapping)
        operator.pass_time(1.0)
        hive.network.heal(flapping)
        operator.pass_time(1.0)

    # An election in which nobody gets a majority takes an epoch as well, but nobody speaks in it.
    spoken = sorted({(b.epoch, b.active) for _, b in operator.beats if b.sent > since})
    deposed = [who for _, who in spoken[:-1]]
    assert set(deposed) <= {active}
    assert len(deposed) <= CUTS
    assert overlaps(operator, since) == []
    assert is_done(operator, "flapping")


def test_a_tenth_of_all_packets_lost_costs_no_takeover(hive, operator):
    epoch = operator.last.epoch
    hive.network.lose(10)
    worked = is_done(operator, "tenth")
    operator.pass_time(12.0)

    assert worked
    assert operator.last.epoch == epoch


@pytest.mark.parametrize("percent", [30, 50])
def test_where_many_packets_are_lost_nobody_else_speaks_and_every_task_is_done_once(
    hive, operator, percent
):
    since = time.monotonic()
    tasks = {
        f"loss{percent}-{y}": make_task(f"loss{percent}-{y}", (1.0, float(y))) for y in range(4)
    }
    hive.network.lose(percent)
    for task in tasks.values():
        operator.post_once(task)
    operator.pass_time(12.0)
    hive.network.heal()
    for task in tasks.values():
        operator.post(task)

    assert {operator.follow(name) for name in tasks} == {TaskState.DONE}
    assert [len(set(starters(operator, name))) for name in tasks] == [1] * len(tasks)
    assert overlaps(operator, since) == []
