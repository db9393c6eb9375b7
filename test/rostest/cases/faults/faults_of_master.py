# SPDX-License-Identifier: BSD-3-Clause
"""What happens to a hive of real nodes when its ROS master is killed and started anew.

The master is one of its own, because rostest does not survive the loss of the one it has started.
"""

import os
import socket

import pytest
import rosgraph
import rospy
from blackboard.msg import TaskState
from held_clock import PATIENT, STEADY

from blackboard.ros.master_watch import watch_master
from hive_common.machine_clock import machine_time
from hive_lab.live.fake_base import FakeBase
from hive_lab.live.live_hive import ROBOTS, LiveHive, own_master
from hive_lab.live.live_operator import LiveOperator, make_task


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture(scope="module")
def master(tmp_path_factory):
    """A ROS master that may be killed."""
    os.environ["ROS_MASTER_URI"] = f"http://127.0.0.1:{free_port()}"
    with own_master(tmp_path_factory.mktemp("master")) as master:
        yield master


@pytest.fixture(scope="module")
def hive(master, tmp_path_factory):
    """A hive on that master."""
    assert master.is_running
    rospy.init_node("faults", anonymous=True, disable_signals=True)
    watch_master(lambda _state: None)
    folder = tmp_path_factory.mktemp("hive")
    hive = LiveHive(folder, "/master/", blackboard=STEADY, robot=PATIENT)
    hive.drives = [FakeBase(f"/master/{name}", x=float(i)) for i, name in enumerate(ROBOTS)]
    hive.operator = LiveOperator(hive.namespace, hive.members)
    try:
        hive.start_all()
        yield hive
    finally:
        hive.end()
        rospy.signal_shutdown("what follows ends the master")


def publishers(topic):
    """Return the publishers of a topic by the master; none while there is no master."""
    try:
        known, _, _ = rosgraph.Master("/faults").getSystemState()
    except (OSError, rosgraph.MasterException):
        return set()
    return set(dict(known).get(topic, ()))


def test_without_a_master_tasks_go_on_and_failover_works_and_a_new_master_knows_all(hive, master):
    operator = hive.operator
    operator.wait_until_whole()
    operator.demand(operator.hears_all, "the operator is connected to every member")
    for drive in hive.drives:
        drive.seconds = 3.0
    operator.post(make_task("under-way", (5.0, 1.0)))
    operator.demand(lambda: operator.state_of("under-way") >= TaskState.STARTED, "it is begun")
    master.kill()

    assert operator.follow("under-way") == TaskState.DONE

    active = operator.last.active
    since = machine_time()
    hive.kill(active)
    operator.wait_for_another(active, since)

    assert operator.post(make_task("no-master", (6.0, 1.0))).state == TaskState.WAITING
    assert operator.follow("no-master") == TaskState.DONE

    living = set(hive.members) - {active}
    operator.demand(
        lambda: all("the ROS master does not answer" in hive.log_of(name) for name in living),
        "every member says that the master is gone",
    )
    master.start()
    operator.demand(lambda: publishers("/master/bb_backup") >= living, "the master knows them")
    hive.set_parameters()
    operator.forget_answers()
    hive.restart_ended()
    operator.wait_until_whole()
    assert operator.post(make_task("new-master", (7.0, 1.0))).state == TaskState.WAITING
    assert operator.follow("new-master") == TaskState.DONE
