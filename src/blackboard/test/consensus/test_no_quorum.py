# SPDX-License-Identifier: BSD-3-Clause
"""What is said about a hive that waits for members that do not come."""

from blackboard.consensus.log import Log, Position, Snapshot
from blackboard.consensus.member import Member, Role
from blackboard.consensus.no_quorum import PATIENCE, REPEAT, NoQuorum
from blackboard.domain.settings import RaftSettings
from hive_lab.virtual.network import Network, NetworkTalker

OLD_FLEET = ("/blackboard#1", "/robot1/robot#2", "/robot2/robot#3", "/robot3/robot#4")


class Harness:
    """A member of a hive that had more members yesterday."""

    def __init__(self):
        self.network = Network()
        self.talker = NetworkTalker(self.network, "blackboard")
        log = Log.of(Snapshot(Position(3, 7), members=OLD_FLEET))
        self.member = Member("/blackboard#1", RaftSettings(), log, epoch=3, heard=0.0)
        self.no_quorum = NoQuorum(self.talker, lambda: self.member, "/disk/blackboard.sqlite3")

    def look_for(self, duration):
        for _ in range(int(duration)):
            self.network.run(1.0)
            self.no_quorum.look()


def test_a_member_that_waits_for_a_majority_says_for_whom_and_what_can_be_done():
    harness = Harness()
    harness.look_for(PATIENCE + 1)

    assert len(harness.talker.warnings) == 1
    said = harness.talker.warnings[0]
    assert "/blackboard has heard no active blackboard for 10 s" in said
    assert "4 members (/blackboard, /robot1/robot, /robot2/robot, /robot3/robot), and 3 of" in said
    assert "parameter journal" in said
    assert "/disk/blackboard.sqlite3" in said
    assert harness.no_quorum.text.endswith(said[-400:])


def test_it_is_said_again_now_and_then():
    harness = Harness()
    harness.look_for(PATIENCE + 2 * REPEAT + 1)

    assert len(harness.talker.warnings) == 3


def test_a_takeover_is_no_standstill():
    harness = Harness()
    harness.look_for(PATIENCE - 1)
    harness.member = harness.member.but(heard=harness.network.now)
    harness.look_for(PATIENCE - 1)

    assert not harness.talker.warnings
    assert not harness.no_quorum.text


def test_the_active_blackboard_does_not_wait_for_itself():
    harness = Harness()
    harness.member = harness.member.but(role=Role.LEADER)
    harness.look_for(3 * PATIENCE)

    assert not harness.talker.warnings


def test_a_robot_that_never_heard_of_a_hive_asks_for_its_blackboard_node():
    harness = Harness()
    harness.member = Member("/robot1/robot#9", RaftSettings(), Log.of(Snapshot()), heard=0.0)
    harness.look_for(PATIENCE + 1)

    assert "start the hive's blackboard node" in harness.talker.warnings[0]
