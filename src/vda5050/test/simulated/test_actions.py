# SPDX-License-Identifier: BSD-3-Clause
"""A simulated AGV does the actions of its order in turn, and drives only where they let it."""

import attrs
import pytest

from vda5050.protocol.actions import ActionStatus, BlockingType
from vda5050.protocol.topics import Topic
from vda5050.protocol.versions import Version
from vda5050.simulated.testing import Rig, action, node, order


def wait(action_id, seconds, blocking):
    return action("wait", action_id, BlockingType[blocking], duration=seconds)


def statuses(rig, action_id):
    """Return the statuses that were told of an action, without repetitions."""
    told = [state.action(action_id) for state in rig.all(Topic.STATE)]
    names = [each.action_status.value for each in told if each is not None]
    return [each for i, each in enumerate(names) if i == 0 or each != names[i - 1]]


def test_it_picks_on_one_node_and_drops_on_the_next(each_version):
    rig = each_version
    pick = action("pick", "p1", loadId="L7", loadType="EPAL", weight=40.0)
    rig.send(
        order(
            [
                node(0, 2, 2),
                node(1, 4, 2, actions=[pick]),
                node(2, 6, 2, actions=[action("drop", "d1", loadId="L7")]),
            ]
        )
    )
    rig.run_until(lambda: rig.status("p1") == "RUNNING")
    assert rig.pose.x == pytest.approx(4.0, abs=0.1)
    rig.run_until(lambda: rig.state.loads)
    [load] = rig.state.loads
    assert (load.load_id, load.weight) == ("L7", 40.0)

    rig.run_until(lambda: rig.is_idle)
    assert statuses(rig, "d1") == ["WAITING", "RUNNING", "FINISHED"]
    assert rig.state.loads == ()


@pytest.mark.parametrize(("blocking", "drives"), [("NONE", True), ("SOFT", False)])
def test_only_some_blocking_types_let_it_drive_on(rig, blocking, drives):
    beep = wait("w1", 30.0, blocking)
    rig.send(order([node(0, 2, 2), node(1, 3, 2, actions=[beep]), node(2, 7, 2)]))
    rig.run(10.0)

    assert rig.status("w1") == "RUNNING"
    assert (rig.pose.x > 4) is drives


@pytest.mark.parametrize(
    ("first", "second", "together"),
    [
        ("NONE", "NONE", True),
        ("SOFT", "NONE", True),
        ("SOFT", "SOFT", True),
        ("HARD", "NONE", False),
        ("SOFT", "HARD", False),
        ("NONE", "SINGLE", False),
        ("SINGLE", "NONE", False),
    ],
)
def test_actions_are_done_together_only_where_both_allow_it(first, second, together):
    rig = Rig(Version.V3_0)
    rig.send(order([node(0, 2, 2, actions=[wait("w1", 5.0, first), wait("w2", 5.0, second)])]))
    rig.run(1.0)
    assert rig.status("w1") == "RUNNING"
    assert (rig.status("w2") == "RUNNING") is together

    took = rig.run_until(lambda: rig.is_idle)
    assert (took < 6.0) is together


def test_an_action_of_an_edge_ends_with_the_edge(rig):
    beep = wait("w1", 60.0, "NONE")
    way = [node(0, 2, 2), node(1, 5, 2), node(2, 8, 2)]
    rig.send(order(way, on_edges={1: [beep]}))
    rig.run_until(lambda: rig.status("w1") == "RUNNING")
    assert rig.pose.x < 3
    rig.run_until(lambda: rig.state.last_node_id == "n1")

    assert rig.status("w1") == "FINISHED"
    assert rig.pose.x < 6


def test_an_action_of_an_edge_that_is_released_later_is_done_too(rig):
    beep = wait("w1", 1.0, "HARD")
    rig.send(order([node(0, 2, 2), node(1, 3, 2, released=False)], on_edges={1: [beep]}))
    rig.run(2.0)
    assert rig.status("w1") == "WAITING"
    rig.send(order([node(0, 2, 2), node(1, 3, 2)], update=1, on_edges={1: [beep]}))
    rig.run_until(lambda: rig.is_idle)

    assert statuses(rig, "w1") == ["WAITING", "RUNNING", "FINISHED"]


def test_the_actions_of_a_node_that_is_sent_again_are_done_once(rig):
    pick = action("pick", "p1")
    rig.send(order([node(0, 2, 2, actions=[pick])]))
    rig.run_until(lambda: rig.is_idle)
    rig.send(order([node(0, 2, 2, actions=[pick]), node(1, 4, 2)], update=1))
    rig.run_until(lambda: rig.state.last_node_id == "n1")

    assert statuses(rig, "p1") == ["RUNNING", "FINISHED"]


def test_an_action_that_fails_says_why(rig):
    rig.agv.mischief.do("fail pick 1")
    rig.send(order([node(0, 2, 2, actions=[action("pick", "p1")])]))
    rig.run_until(lambda: rig.is_idle)

    found = rig.state.action("p1")
    assert found.action_status is ActionStatus.FAILED
    assert "failed" in found.action_result
    assert rig.state.loads == ()


def test_a_retriable_action_is_tried_again_or_given_up():
    rig = Rig(Version.V3_0)
    rig.agv.mischief.do("fail pick 2")
    pick = attrs.evolve(action("pick", "p1"), retriable=True)
    rig.send(order([node(0, 2, 2, actions=[pick])]))
    rig.run_until(lambda: rig.status("p1") == "RETRIABLE")
    rig.instantly("retry", "r1", actionId="p1")
    rig.run_until(lambda: rig.status("p1") == "RUNNING")
    rig.run_until(lambda: rig.status("p1") == "RETRIABLE")
    rig.instantly("skipRetry", "r2", actionId="p1")
    rig.run(0.5)

    assert rig.status("p1") == "FAILED"
    assert (rig.status("r1"), rig.status("r2")) == ("FINISHED", "FINISHED")


def test_a_load_makes_nothing_of_a_second_pick(rig):
    pick, again = action("pick", "p1", loadId="A"), action("pick", "p2", loadId="B")
    rig.send(order([node(0, 2, 2, actions=[pick, again])]))
    rig.run_until(lambda: rig.is_idle)

    assert rig.status("p2") == "FAILED"
    assert [each.load_id for each in rig.state.loads] == ["A"]
