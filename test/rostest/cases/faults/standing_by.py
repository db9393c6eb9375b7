# SPDX-License-Identifier: BSD-3-Clause
"""A hive of real nodes in which some robots are learners."""

import pytest
import rosgraph
import rospy
from blackboard.msg import TaskState
from held_clock import PATIENT, STEADY

from hive_common.machine_clock import machine_time
from hive_lab.live.fake_base import FakeBase
from hive_lab.live.live_hive import LiveHive
from hive_lab.live.live_operator import LiveOperator, make_task

OF_THE_BLACKBOARD = ("new_task", "task_bc", "task_assign", "bb_backup", "bb_sync", "bb_entries")
TO_THE_BLACKBOARD = ("new_task", "task_cost", "task_state", "robot_status", "bb_ack")


@pytest.fixture(scope="module")
def hive(tmp_path_factory):
    """A hive of a blackboard node, two robots that are voters and two learners."""
    rospy.init_node("standing_by", disable_signals=True)
    hive = LiveHive(
        tmp_path_factory.mktemp("hive"),
        blackboard={"bid_timeout": 30.0, **STEADY},  # nobody who is slow is left out
        robot=PATIENT,
        standing_by=2,
    )
    hive.drives = {name: FakeBase(f"/{name}", x=5.0 * i) for i, name in enumerate(hive.robots)}
    hive.operator = LiveOperator(hive.namespace, hive.members)
    try:
        hive.start_all()
        yield hive
    finally:
        hive.end()


@pytest.fixture
def operator(hive):
    """The hive's operator, once all members answer and all voters have a vote."""
    hive.operator.demand(
        lambda: hive.operator.all_answer() and len(hive.operator.last.members) == 3,
        "all members answer, and three have a vote",
    )
    return hive.operator


def test_who_does_not_stand_by_is_not_connected_as_a_blackboard_is(hive, operator):
    publishers, subscribers, _ = rosgraph.Master("/standing_by").getSystemState()
    aside = {hive.node_of(name) for name in hive.robots[2:]}
    speaks, listens = dict(publishers), dict(subscribers)

    assert set(operator.last.members) == set(hive.members) - aside
    assert {t for t in OF_THE_BLACKBOARD if aside & set(speaks[f"/{t}"])} == set()
    assert {t for t in TO_THE_BLACKBOARD if aside & set(listens[f"/{t}"])} == set()


def test_who_does_not_stand_by_works_on_when_the_blackboard_is_killed(hive, operator):
    drive = hive.drives["robot4"]
    drive.seconds = 2.0
    operator.post(make_task("k1", (15.0, 1.0)))
    operator.demand(lambda: operator.state_of("k1") >= TaskState.STARTED, "k1 is begun")
    operator.forget_answers()
    since = machine_time()
    hive.kill(hive.blackboard)
    operator.wait_for_another(hive.blackboard, since)

    assert operator.follow("k1") == TaskState.DONE
    assert drive.arrivals.count((15.0, 1.0)) == 1
    operator.post(make_task("k2", (10.0, 1.0)))
    assert operator.follow("k2") == TaskState.DONE
    assert operator.record_of("k2").robot == "robot3"
    assert operator.last.active in {hive.node_of("robot1"), hive.node_of("robot2")}
