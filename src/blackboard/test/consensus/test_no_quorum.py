# SPDX-License-Identifier: BSD-3-Clause
"""The warning about a hive that waits for members that do not come."""

from blackboard.consensus.log import Log, Position, Snapshot
from blackboard.consensus.member import Member, Role
from blackboard.consensus.no_quorum import REPEAT, TIMEOUT, NoQuorum
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


def test_a_member_without_a_majority_names_the_members_and_the_remedy():
    harness = Harness()
    harness.look_for(TIMEOUT + 1)

    assert len(harness.talker.warnings) == 1
    warning = harness.talker.warnings[0]
    assert "blackboard has heard no leader for 10 s" in warning
    assert "4 members (blackboard, robot1/robot, robot2/robot, robot3/robot), and 3 of" in warning
    assert "go on without: hive recover --force-members" in warning
    assert "journal:=FOLDER" in warning
    assert "/disk/blackboard.sqlite3" in warning
    assert harness.no_quorum.text.endswith(warning[-400:])


def test_the_warning_is_repeated():
    harness = Harness()
    harness.look_for(TIMEOUT + 2 * REPEAT + 1)

    assert len(harness.talker.warnings) == 3


def test_a_failover_causes_no_warning():
    harness = Harness()
    harness.look_for(TIMEOUT - 1)
    harness.member = harness.member.evolve(heard=harness.network.now)
    harness.look_for(TIMEOUT - 1)

    assert not harness.talker.warnings
    assert not harness.no_quorum.text


def test_the_leader_does_not_wait_for_itself():
    harness = Harness()
    harness.member = harness.member.evolve(role=Role.LEADER)
    harness.look_for(3 * TIMEOUT)

    assert not harness.talker.warnings


def test_a_robot_without_a_hive_asks_for_the_blackboard_node():
    harness = Harness()
    harness.member = Member("/robot1/robot#9", RaftSettings(), Log.of(Snapshot()), heard=0.0)
    harness.look_for(TIMEOUT + 1)

    assert "start the hive's blackboard node" in harness.talker.warnings[0]


def test_a_blackboard_node_that_may_not_bootstrap_a_hive_repeats_why():
    network = Network()
    talker = NetworkTalker(network, "blackboard")
    member = Member("/blackboard#9", RaftSettings(), Log.of(Snapshot()), heard=0.0)
    no_quorum = NoQuorum(talker, lambda: member, "/disk/b.sqlite3", "robot1 belongs to hive 7")
    network.run(TIMEOUT + 1)
    no_quorum.look()

    assert no_quorum.text.endswith("no leader for 11 s; robot1 belongs to hive 7")
