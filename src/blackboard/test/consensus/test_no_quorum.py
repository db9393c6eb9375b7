# SPDX-License-Identifier: BSD-3-Clause
"""What is said about a hive that waits for members that do not come."""

from blackboard.consensus.log import Log, Position, Whole
from blackboard.consensus.member import Member, Role
from blackboard.consensus.no_quorum import PATIENCE, REPEAT, Standstill
from blackboard.domain.settings import BackupSettings
from hive_lab.virtual.hive import Network, NetworkTalker

OLD_FLEET = ("/blackboard#1", "/robot1/robot#2", "/robot2/robot#3", "/robot3/robot#4")


class Rig:
    """A member of a hive that had more members yesterday."""

    def __init__(self):
        self.network = Network()
        self.talker = NetworkTalker(self.network, "blackboard")
        log = Log.of(Whole(Position(3, 7), members=OLD_FLEET))
        self.member = Member("/blackboard#1", BackupSettings(), log, epoch=3, heard=0.0)
        self.standstill = Standstill(self.talker, lambda: self.member, "/disk/blackboard.sqlite3")

    def look_for(self, duration):
        for _ in range(int(duration)):
            self.network.run(1.0)
            self.standstill.look()


def test_a_member_that_waits_for_a_majority_says_for_whom_and_what_can_be_done():
    rig = Rig()
    rig.look_for(PATIENCE + 1)

    assert len(rig.talker.warnings) == 1
    said = rig.talker.warnings[0]
    assert "/blackboard has heard no active blackboard for 10 s" in said
    assert "4 members (/blackboard, /robot1/robot, /robot2/robot, /robot3/robot), and 3 of" in said
    assert "parameter journal" in said
    assert "/disk/blackboard.sqlite3" in said
    assert rig.standstill.text.endswith(said[-400:])


def test_it_is_said_again_now_and_then():
    rig = Rig()
    rig.look_for(PATIENCE + 2 * REPEAT + 1)

    assert len(rig.talker.warnings) == 3


def test_a_takeover_is_no_standstill():
    rig = Rig()
    rig.look_for(PATIENCE - 1)
    rig.member = rig.member.but(heard=rig.network.now)
    rig.look_for(PATIENCE - 1)

    assert not rig.talker.warnings
    assert not rig.standstill.text


def test_the_active_blackboard_does_not_wait_for_itself():
    rig = Rig()
    rig.member = rig.member.but(role=Role.ACTIVE)
    rig.look_for(3 * PATIENCE)

    assert not rig.talker.warnings


def test_a_robot_that_never_heard_of_a_hive_asks_for_its_blackboard_node():
    rig = Rig()
    rig.member = Member("/robot1/robot#9", BackupSettings(), Log.of(Whole()), heard=0.0)
    rig.look_for(PATIENCE + 1)

    assert "start the hive's blackboard node" in rig.talker.warnings[0]
