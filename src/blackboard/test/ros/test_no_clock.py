# SPDX-License-Identifier: BSD-3-Clause
"""A member that waits for simulated time says so."""

from blackboard.ros.no_clock import REPEAT, TIMEOUT, NoClock
from hive_lab.virtual.network import Network, NetworkTalker


def watched(network):
    """Return a talker and what watches over its time, once a second."""
    talker = NetworkTalker(network, "robot1")
    watch = NoClock(talker)
    talker.every(1.0, watch.look)
    return talker, watch


def test_a_member_without_time_names_the_parameter_and_the_remedy():
    network = Network(world_rate=0.0)
    talker, watch = watched(network)

    network.run(TIMEOUT - 0.5)
    assert watch.text == ""
    network.run(1.0)
    assert "/use_sim_time is true" in watch.text
    assert "rosparam set /use_sim_time false" in watch.text
    assert talker.warnings == [watch.text]


def test_the_warning_comes_again_now_and_then():
    network = Network(world_rate=0.0)
    talker, _ = watched(network)

    network.run(TIMEOUT + 2 * REPEAT + 0.5)

    assert len(talker.warnings) == 3


def test_nothing_is_said_once_time_has_come():
    network = Network(world_rate=0.0)
    talker, watch = watched(network)
    network.run(TIMEOUT + 0.5)
    network.world_rate = 1.0
    network.run(2 * REPEAT)

    assert watch.text == ""
    assert len(talker.warnings) == 1


def test_a_simulation_that_is_paused_later_is_no_fault():
    network = Network(begun=5.0, world_rate=0.0)
    talker, _ = watched(network)
    network.run(2 * REPEAT)

    assert talker.warnings == []
