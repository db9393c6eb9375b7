# SPDX-License-Identifier: BSD-3-Clause
"""What happens to a hive on several hosts whose network is cut or loses packets, or which sleep.

The office, where the ROS master and the operator are, hears both sides of a split, so that two
active blackboards at once would be seen. Times are those of the hive's clock, which the test has.
"""

import os
import signal
import subprocess
import sys
import time
from collections import defaultdict
from itertools import pairwise

import pytest
import rospy
from blackboard.msg import TaskState
from held_clock import HeldHive
from live_network import OFFICE, network_of

from hive_lab.live.fake_base import FakeBase
from hive_lab.live.live_hive import own_master
from hive_lab.live.live_operator import LiveOperator, make_task

ROBOTS = ("robot1", "robot2", "robot3", "robot4")
HOSTS = ("blackboard", *ROBOTS)
TAKEOVER = 3.5
"""Longer than another member needs to take over without a proven death [s]."""
DRIVE = 2.0
"""Duration of each drive [s, wall clock], unless it is held."""
HOLD, ARRIVE = signal.SIGUSR1, signal.SIGUSR2
"""What a fake base is sent so that its drives last until it may arrive."""
CUTS = 5
"""Number of times a bad cable loses contact."""
LOST = 8.0
"""Longer than the silence of a lost robot [s]."""
STEPS_DOWN = "is no longer the leader"
NOTICED = 1.2
"""Who wakes knows within this time how long it slept, if it hears nobody [s]."""


@pytest.fixture(scope="session")
def network():
    """A host for each member."""
    with network_of(HOSTS) as network:
        yield network


@pytest.fixture(scope="session")
def hive(network, tmp_path_factory):
    """A hive whose members are on hosts of their own, and which waits for lost robots."""
    os.environ.update(ROS_MASTER_URI=f"http://{OFFICE}:11311", ROS_IP=OFFICE)
    with own_master(tmp_path_factory.mktemp("master")):
        rospy.init_node("faults", anonymous=True, disable_signals=True)
        folder = tmp_path_factory.mktemp("hive")
        hive = HeldHive(folder, "/networks/", ROBOTS, blackboard={"on_robot_lost": "wait"})
        hive.network, hive.bases = network, {}
        hive.operator = LiveOperator(hive.namespace, hive.members)
        try:
            for x, name in enumerate(ROBOTS):
                hive.bases[name] = start_base(network, name, float(x))
            start_all(hive, network)
            yield hive
        finally:
            hive.end()
            for base in hive.bases.values():
                base.kill()
                base.wait()
            rospy.signal_shutdown("what follows ends the master")


@pytest.fixture
def sleepers(hive, tmp_path):
    """Another hive, two of whose hosts have robots, and bases with computers of their own."""
    sleepers = HeldHive(tmp_path, "/sleepers/", ROBOTS[:2])
    sleepers.bases = {
        robot: FakeBase(f"/sleepers/{robot}", x=float(x)) for x, robot in enumerate(ROBOTS[:2])
    }
    sleepers.operator = LiveOperator(sleepers.namespace, sleepers.members)
    try:
        start_all(sleepers, hive.network)
        sleepers.operator.wait_until_whole()
        yield sleepers
    finally:
        hive.network.heal()
        sleepers.end()


@pytest.fixture
def operator(hive):
    """The hive's operator, once the hive is complete."""
    hive.operator.wait_until_whole()
    yield hive.operator
    hive.operator.forget_answers()
    hive.network.heal()


def start_all(hive, network):
    """Start each node of a hive on its host."""
    for node in hive.members:
        host = host_of(hive, node)
        where = {"ROS_IP": network.address(host)}
        hive.start(node, prefix=network.prefix(host), environment=where)


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


def node_on(hive, host):
    """Return the member on a host."""
    return next(node for node in hive.members if host_of(hive, node) == host)


def followers(hive, operator):
    """Return the hosts of members that are neither leader nor backup."""
    leading = {operator.last.active, operator.last.backup}
    return [host_of(hive, node) for node in hive.members if node not in leading]


def reigns(operator, since):
    """Return the first and last heartbeat of each epoch's leader [s], in order of epochs.

    All hosts share one clock. Arrival times say less: a healed network delivers
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
    since = hive.clock.now()
    hive.network.split(minority, [host for host in HOSTS if host not in minority])
    operator.wait_for_another(active, since)
    worked = is_done(operator, "split")
    hive.network.heal()
    operator.wait_until_whole()

    assert worked
    assert overlaps(operator, since) == []


def test_where_no_group_is_a_majority_nobody_is_active_and_tasks_wait(hive, operator):
    since = hive.clock.now()
    hive.network.split(HOSTS[:2], HOSTS[2:4], HOSTS[4:])
    while hive.clock.now() - max(beat.sent for _, beat in operator.beats) <= TAKEOVER:
        hive.clock.pass_time(TAKEOVER)  # whoever is the leader has to step down first
    operator.post_once(make_task("threefold", (2.0, 1.0)))
    hive.clock.pass_time(TAKEOVER)
    unanswered = not operator.updates["threefold"]
    hive.network.heal()

    assert unanswered
    assert is_done(operator, "threefold")
    assert overlaps(operator, since) == []


def test_a_robot_that_is_split_off_from_the_majority_changes_nothing(hive, operator):
    epoch = operator.last.epoch
    lonely = followers(hive, operator)[0]
    hive.network.split([lonely], [host for host in HOSTS if host != lonely])
    with hive.held(node_on(hive, lonely)):
        hive.clock.pass_time(LOST)
        worked = is_done(operator, "majority")
    hive.network.heal()
    operator.wait_until_whole()

    assert worked
    assert operator.last.epoch == epoch


def test_an_active_one_that_hears_nobody_steps_down_and_elections_end(hive, operator):
    active, epoch = operator.last.active, operator.last.epoch
    since = hive.clock.now()
    hive.network.deafen(host_of(hive, active))
    with hive.held(active):
        operator.wait_for_another(active, since)
        hive.clock.pass_time(LOST)

    assert overlaps(operator, since) == []
    # An election in which nobody gets a majority takes an epoch as well, but nobody speaks in it.
    assert len({beat.epoch for _, beat in operator.beats if beat.epoch > epoch}) <= 2
    assert is_done(operator, "deaf")


def test_a_host_that_vanishes_is_replaced_and_comes_back_as_a_follower(hive, operator):
    active, epoch = operator.last.active, operator.last.epoch
    since = hive.clock.now()
    hive.network.unplug(host_of(hive, active))
    operator.wait_for_another(active, since)
    worked = is_done(operator, "vanished")
    back = hive.clock.now()
    hive.network.heal()
    operator.wait_until_whole()

    assert worked
    assert all(beat.epoch > epoch for _, beat in operator.beats if beat.sent > back)


def test_a_leader_whose_machine_slept_knows_that_its_lease_is_over(hive, operator):
    active, epoch = operator.last.active, operator.last.epoch
    since = hive.clock.now()
    hive.network.deafen(host_of(hive, active))  # so that nobody tells it
    hive.sleep(active)
    operator.wait_for_another(active, since)
    hive.clock.pass_time(LOST)
    woke, said = time.monotonic(), hive.log_of(active)
    hive.wake(active)
    hive.clock.pass_time(NOTICED)
    steps_down = lambda: STEPS_DOWN in hive.log_of(active)[len(said) :]  # noqa: E731  (a sentence)
    operator.demand(steps_down, f"{active} steps down")
    late = [beat for at, beat in operator.beats if at > woke and beat.epoch == epoch]
    hive.network.heal()

    assert len(late) <= 1  # the one that it was about to send
    operator.wait_until_whole()
    assert operator.last.epoch > epoch


def test_a_robot_whose_machine_slept_stops_its_base_though_it_hears_nobody(hive, sleepers):
    operator = sleepers.operator
    for base in sleepers.bases.values():
        base.held = True
    operator.post(make_task("asleep", (5.0, 1.0)))
    operator.demand(lambda: operator.state_of("asleep") == TaskState.STARTED, "it is begun")
    robot = operator.record_of("asleep").robot
    base, other = sleepers.bases[robot], sleepers.bases[next(r for r in ROBOTS if r != robot)]
    node = sleepers.node_of(robot)
    hive.network.deafen(robot)
    sleepers.sleep(node)
    operator.demand(lambda: operator.record_of("asleep").robot != robot, "another robot has it")
    other.held = False
    end = operator.follow("asleep")
    before = base.cancelled
    with sleepers.clock.standing():
        sleepers.wake(node)
        sleepers.clock.pass_time(NOTICED)
        operator.demand(lambda: base.cancelled > before, f"the base of {robot} stops")
    hive.network.heal()
    operator.wait_until_whole()

    assert end == TaskState.DONE
    assert before == 0  # the base drove on while its robot slept
    assert (base.arrivals, other.arrivals) == ([], [(5.0, 1.0)])


def test_a_robot_that_arrives_while_it_is_cut_off_is_believed_and_nobody_drives_again(
    hive, operator
):
    lonely = followers(hive, operator)[0]
    x = float(ROBOTS.index(lonely)) if lonely in ROBOTS else 0.0
    for base in hive.bases.values():
        base.send_signal(HOLD)
    operator.post(make_task("alone", (x, 0.5)))
    operator.demand(lambda: operator.state_of("alone") >= TaskState.STARTED, "it is begun")
    robot = operator.record_of("alone").robot
    hive.network.unplug(robot)
    for base in hive.bases.values():
        base.send_signal(ARRIVE)
    hive.clock.pass_time(LOST)
    unheard = operator.state_of("alone")
    hive.network.heal()

    assert unheard == TaskState.STARTED
    assert operator.follow("alone") == TaskState.DONE
    assert set(starters(operator, "alone")) == {robot}


def test_a_cable_that_comes_and_goes_costs_few_takeovers(hive, operator):
    active = operator.last.active
    flapping = host_of(hive, active)
    since = hive.clock.now()
    with hive.held(active):
        for _ in range(CUTS):
            hive.network.unplug(flapping)
            hive.clock.pass_time(1.0)
            hive.network.heal(flapping)
            hive.clock.pass_time(1.0)

    # An election in which nobody gets a majority takes an epoch as well, but nobody speaks in it.
    spoken = sorted({(b.epoch, b.active) for _, b in operator.beats if b.sent > since})
    deposed = [who for _, who in spoken[:-1]]
    assert set(deposed) <= {active}
    assert len(deposed) <= CUTS
    assert overlaps(operator, since) == []
    assert is_done(operator, "flapping")


def test_a_tenth_of_all_packets_lost_costs_no_takeover(hive, operator):
    epoch = operator.last.epoch
    with hive.held():
        hive.network.lose(10)
        worked = is_done(operator, "tenth")
        hive.clock.pass_time(12.0)

    assert worked
    assert operator.last.epoch == epoch


@pytest.mark.parametrize("percent", [30, 50])
def test_where_many_packets_are_lost_nobody_else_speaks_and_every_task_is_done_once(
    hive, operator, percent
):
    since = hive.clock.now()
    tasks = {
        f"loss{percent}-{y}": make_task(f"loss{percent}-{y}", (1.0, float(y))) for y in range(4)
    }
    hive.network.lose(percent)
    for task in tasks.values():
        operator.post_once(task)
    hive.clock.pass_time(12.0)
    hive.network.heal()
    for task in tasks.values():
        operator.post(task)

    assert {operator.follow(name) for name in tasks} == {TaskState.DONE}
    # The operator may have missed that a robot began; a second robot would have done it again.
    assert all(len(set(starters(operator, name))) <= 1 for name in tasks)
    assert overlaps(operator, since) == []
