# SPDX-License-Identifier: BSD-3-Clause
"""What happens to a hive on several machines, each with a ROS master of its own, over Zenoh.

The operator is in the office: this program, the gateway, and a master of their own.
"""

import contextlib
import time

import pytest
import rospy
from blackboard.msg import RobotStatus
from geometry_msgs.msg import PoseWithCovarianceStamped
from launching import run_hive
from live_network import network_of
from live_site import GATEWAY, doers, post, site_on
from nav_msgs.msg import Path
from tf2_msgs.msg import TFMessage

from blackboard.zenoh.access import Role
from hive_lab.live.live_operator import make_task
from hive_lab.runner.limits import PATIENCE

ROBOTS = ("robot1", "robot2", "robot3", "robot4")
HOSTS = ("blackboard", *ROBOTS)
CUT = 14.0
"""Longer than Zenoh keeps a silent connection [s]."""


@pytest.fixture(scope="session")
def network():
    """A host for each member."""
    with network_of(HOSTS) as network:
        yield network


@pytest.fixture(scope="session")
def site(network, tmp_path_factory):
    """A hive whose members share no ROS master."""
    strangers = {"eve": Role.VIEWER}
    with site_on(
        network, "many_machines", tmp_path_factory, strangers=strangers, robots=ROBOTS
    ) as site:
        yield site


@pytest.fixture
def operator(site, network):
    """The hive's operator, once the hive is complete."""
    site.operator.wait_until_whole()
    yield site.operator
    site.operator.forget_answers()
    network.heal()


def test_tasks_that_are_posted_at_the_gateway_are_done(operator):
    tasks = post(operator, "gateway", 8)

    assert len(doers(operator, tasks)) > 1


def test_the_operator_s_commands_reach_the_hive_through_the_gateway(operator):
    listed = run_hive("robots")
    assert listed.returncode == 0, listed.stderr
    assert all(robot in listed.stdout for robot in ROBOTS)

    for word, state in (("out", RobotStatus.DEFECT), ("in", RobotStatus.IDLE)):
        told = run_hive("robot", "robot4", word, "--yes")
        assert told.returncode == 0, told.stderr
        operator.demand(
            lambda state=state: operator.robots["robot4"].state == state, f"robot4 is {word}"
        )


def test_the_operator_s_commands_need_neither_a_gateway_nor_a_ros_master(site, operator):
    listed = site.hive("robots")
    assert listed.returncode == 0, listed.stderr
    assert all(robot in listed.stdout for robot in ROBOTS)

    added = site.hive("add", "GA", "--goal", "3,1", "--id", "by-hand", "--wait")
    assert (added.returncode, added.stdout) == (0, "by-hand\n"), added.stderr
    assert doers(operator, ["by-hand"])
    for word, state in (("out", RobotStatus.DEFECT), ("in", RobotStatus.IDLE)):
        told = site.hive("robot", "robot4", word, "--yes")
        assert told.returncode == 0, told.stderr
        operator.demand(
            lambda state=state: operator.robots["robot4"].state == state, f"robot4 is {word}"
        )


def test_a_viewer_s_commands_show_the_hive_and_change_nothing(site, operator):
    eve = ("--certificates", str(site.certificates.folder_of("eve")))
    listed = site.hive(*eve, "robots")
    assert listed.returncode == 0, listed.stderr
    assert all(robot in listed.stdout for robot in ROBOTS)

    refused = site.hive(*eve, "add", "GA", "--goal", "3,1", "--id", "by-eve")

    assert refused.returncode == 2
    assert "eve has a viewer's certificate" in refused.stderr
    assert operator.record_of("by-eve") is None


def test_a_command_follows_its_tasks_while_the_leader_s_host_is_killed(site, operator):
    leader = operator.wait_until_whole()
    with site.hive_started("load", "--at-once", "12", "--mix", "GA=1", "--wait") as command:
        operator.demand(lambda: operator.updates, "the tasks are on the list")
        site.kill_host(site.host_of(leader))
        _, said = command.communicate(timeout=PATIENCE)

    assert command.returncode == 0, said
    site.start_host(site.host_of(leader))


class Shown:
    """Where the operator's machine shows robots, by three ways to see it: y [m] of each robot."""

    def __init__(self):
        self.poses, self.paths, self.frames = {}, {}, {}
        self._ears = [rospy.Subscriber("/tf", TFMessage, self._hear_frames)]
        for robot in ROBOTS:
            topics = {"amcl_pose": PoseWithCovarianceStamped, "move_base/plan": Path}
            self._ears += [
                rospy.Subscriber(f"/{robot}/{topic}", kind, self._hear, robot)
                for topic, kind in topics.items()
            ]

    def _hear(self, msg, robot):
        if isinstance(msg, Path):
            self.paths[robot] = msg.poses[-1].pose.position.y
        else:
            self.poses[robot] = msg.pose.pose.position.y

    def _hear_frames(self, msg):
        for each in msg.transforms:
            self.frames[each.child_frame_id] = each.transform.translation.y

    def is_at(self, robots, y):
        """Return whether all three show robots at y."""
        ways = (self.poses, self.paths)
        bases = (self.frames.get(f"{robot}/base_footprint") for robot in robots)
        return all(way.get(robot) == y for way in ways for robot in robots) and {*bases} == {y}

    def forget(self):
        """Forget what was seen so far."""
        for seen in (self.poses, self.paths, self.frames):
            seen.clear()

    def close(self):
        """See no more."""
        for each in self._ears:
            each.unregister()


def test_the_operator_s_machine_shows_where_robots_are_and_drive(site, operator):
    with contextlib.closing(Shown()) as shown:
        far = 7.0
        tasks = [make_task(f"shown-{x}", (float(x), far)) for x in range(6)]
        for task in tasks:
            operator.post(task)
        robots = doers(operator, [task.id for task in tasks])
        operator.demand(lambda: shown.is_at(robots, far), f"{robots} are shown at y = {far}")

        site.kill(GATEWAY)
        shown.forget()
        site.start_gateway()
        operator.demand(lambda: shown.is_at(robots, far), "they are shown there again", CUT)


@pytest.mark.usefixtures("operator")
def test_what_a_robot_announces_reaches_each_robot_once(site):
    hosts = ("robot1", "robot2", "robot3")
    with contextlib.ExitStack() as stack:
        nodes = [stack.enter_context(site.traffic_on(host)) for host in hosts]
        for word in ("first", "second", "third"):
            print(word, file=nodes[0].stdin, flush=True)

            # One that comes twice would be there in place of the next word.
            assert [node.stdout.readline().strip() for node in nodes] == [word] * 3


@pytest.mark.usefixtures("operator")
def test_nothing_but_the_hive_s_port_is_reached_from_the_network(site, network):
    open_ports = {host: network.open_on(host) for host in HOSTS}

    assert open_ports == {host: {site.address_of(host)} for host in HOSTS}


def test_another_host_takes_over_when_the_leader_s_host_is_killed(site, operator, record_property):
    for number in range(2):
        leader = operator.wait_until_whole()
        host = site.host_of(leader)
        tasks = post(operator, f"killed-{number}", 8)

        since = time.monotonic()
        site.kill_host(host)

        record_property("takeover [s]", operator.wait_for_another(leader, since))
        doers(operator, tasks)
        operator.forget_answers()
        site.start_host(host)


def test_another_host_takes_over_while_the_leader_s_process_is_frozen(
    site, operator, record_property
):
    leader = operator.wait_until_whole()
    tasks = post(operator, "frozen", 8)

    since = time.monotonic()
    site.freeze(leader)
    try:
        record_property("takeover [s]", operator.wait_for_another(leader, since))
    finally:
        site.thaw(leader)

    doers(operator, tasks)


def test_a_robot_that_is_cut_off_loses_its_tasks_to_others_and_is_back_afterwards(
    site, network, operator
):
    cut = next(robot for robot in ROBOTS if site.node_of(robot) != operator.last.active)
    tasks = post(operator, "cut", 12)

    network.unplug(cut)
    doers(operator, tasks)
    operator.demand(lambda: cut in operator.last.offline, f"{cut} is offline", CUT)
    operator.pass_time(CUT)
    operator.forget_answers()
    network.heal()

    operator.wait_until_whole()
    operator.demand(lambda: cut not in operator.last.offline, f"{cut} is back")


def test_what_an_operator_posts_while_it_is_cut_off_is_done_once(network, operator):
    network.lose_office()
    for word in ("early", "late"):
        for x in range(3):
            operator.post_once(make_task(f"{word}-{x}", (float(x), 1.0)))
        operator.pass_time(CUT / 2)
    network.heal()

    tasks = [*post(operator, "early", 3), *post(operator, "late", 3)]
    doers(operator, tasks)


def test_nothing_is_lost_or_done_twice_where_a_fifth_of_all_packets_is_lost(network, operator):
    network.lose(20)

    doers(operator, post(operator, "lossy", 8))


def test_the_larger_side_of_a_split_goes_on_and_both_are_one_hive_again_afterwards(
    network, operator
):
    network.split(("blackboard", "robot1", "robot2"), ("robot3", "robot4"))
    operator.demand(
        lambda: {"robot3", "robot4"} <= set(operator.last.offline), "the smaller side is offline"
    )
    tasks = post(operator, "split", 4)
    assert doers(operator, tasks) <= {"robot1", "robot2"}
    operator.forget_answers()
    network.heal()

    operator.wait_until_whole()
    doers(operator, post(operator, "healed", 4))
