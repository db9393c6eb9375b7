# SPDX-License-Identifier: BSD-3-Clause
"""A master that goes and comes back, and the node that registers with it again."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from blackboard.ros.master_watch import MasterState, MasterWatch


class FakeMasterWatch(MasterWatch):
    """A watch on a master that the test plays.

    Attributes:
        pid: What the master answers; None while there is none.
        accepts: Whether the master accepts registrations.
        asked: The masters that the node has registered with, accepted or not.
    """

    def __init__(self):
        super().__init__("/watcher")
        self.pid, self.accepts, self.asked = 1, True, []

    def _ask(self):
        return self.pid

    def _register_again(self):
        self.asked.append(self.pid)
        return self.accepts


def test_the_node_registers_with_a_new_master_once():
    watch = FakeMasterWatch()
    watch.look()
    watch.pid = None
    lost = [watch.look(), watch.look()]
    watch.pid = 2
    back = [watch.look(), watch.look()]

    assert lost == [MasterState.LOST, None]
    assert back == [MasterState.BACK, None]
    assert watch.asked == [2]


def test_the_node_registers_again_with_a_master_that_was_too_busy():
    watch = FakeMasterWatch()
    watch.look()
    watch.pid, watch.accepts = 2, False
    lost = [watch.look(), watch.look()]
    watch.accepts = True

    assert lost == [MasterState.LOST, None]
    assert watch.look() is MasterState.BACK
    assert watch.look() is None
    assert watch.asked == [2, 2, 2]
