# SPDX-License-Identifier: BSD-3-Clause
"""A master that goes, comes back, and is told of the node that watches it."""

import pytest

pytest.importorskip("rospy", reason="the package of the border needs ROS")

from blackboard.ros.master_watch import MasterState, MasterWatch


class WatchOfATalk(MasterWatch):
    """A watch whose talk with the master the test plays.

    Attributes:
        pid: What the master answers; None while there is none.
        takes_nodes: Whether the master takes what is registered.
        told: The masters that were told of the node, taken or not.
    """

    def __init__(self):
        super().__init__("/watcher")
        self.pid, self.takes_nodes, self.told = 1, True, []

    def _ask(self):
        return self.pid

    def _register_again(self):
        self.told.append(self.pid)
        return self.takes_nodes


def test_a_new_master_is_told_of_the_node_once():
    watch = WatchOfATalk()
    watch.look()
    watch.pid = None
    lost = [watch.look(), watch.look()]
    watch.pid = 2
    back = [watch.look(), watch.look()]

    assert lost == [MasterState.LOST, None]
    assert back == [MasterState.BACK, None]
    assert watch.told == [2]


def test_a_new_master_that_is_too_busy_to_take_the_node_is_told_again():
    watch = WatchOfATalk()
    watch.look()
    watch.pid, watch.takes_nodes = 2, False
    lost = [watch.look(), watch.look()]
    watch.takes_nodes = True

    assert lost == [MasterState.LOST, None]
    assert watch.look() is MasterState.BACK
    assert watch.look() is None
    assert watch.told == [2, 2, 2]
