# SPDX-License-Identifier: BSD-3-Clause
"""A robot's lease, as its timers see it."""

from random import Random

from blackboard.consensus.hive_filter import NoFilter
from blackboard.consensus.messages import Heartbeat
from blackboard.domain.talker import BACKUP
from blackboard.robot.lease_keeper import LeaseKeeper
from hive_lab.virtual.network import Network, NetworkTalker


class SlowClock(NetworkTalker):
    """The talker of a member whose clock loses 0.3 %."""

    def now(self):
        return 0.997 * super().now()

    def after(self, delay, action):
        return super().after(delay / 0.997, action)


def last_word(begin, length):
    """Return whether a lease holds when its timer says for the last time that it changed."""
    network = Network()
    network.run(begin)
    said = []
    talker = SlowClock(network, "robot1")
    keeper = LeaseKeeper(
        talker,
        "robot1",
        1.0,
        changed=lambda: said.append(keeper.holds()),
        unheard=lambda: None,
        hive_filter=NoFilter(talker),
    )
    keeper.start()
    beat = Heartbeat(1, "blackboard", heard={"robot1": 0.997 * begin}, robot_lease=length)
    network.send(BACKUP, beat)
    network.run(2 * length)
    return said[-1]


def test_a_lease_has_ended_when_its_timer_says_so_despite_rounding():
    random = Random(1)
    times = [(random.uniform(0.0, 1000.0), random.uniform(1.0, 5.0)) for _ in range(200)]

    assert not any(last_word(begin, length) for begin, length in times)


def test_a_robot_is_asked_for_room_until_a_heartbeat_no_longer_names_it():
    network = Network()
    talker = NetworkTalker(network, "robot1")
    keeper = LeaseKeeper(talker, "robot1", 1.0, lambda: None, lambda: None, NoFilter(talker))
    keeper.start()
    asked = [keeper.makes_room]
    for names in (("robot2",), ("robot2", "robot1"), ()):
        network.send(BACKUP, Heartbeat(1, "blackboard", make_room=names))
        network.run(0.1)
        asked.append(keeper.makes_room)

    assert asked == [False, False, True, False]
