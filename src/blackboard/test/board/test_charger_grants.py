# SPDX-License-Identifier: BSD-3-Clause
"""Each charger belongs to one robot, whatever comes late."""

import pytest

from blackboard.board.charger_grants import ChargerGrants
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.charger import Grant
from hive_common.pose import Pose


class Node:
    """A leader that commits at once."""

    def __init__(self):
        self.version = 7
        self.grants = {}

    def give_chargers(self, grants, there=()):
        self.version += bool(grants)
        for name, robot in grants.items():
            self.grants[name] = Grant(name, robot, self.version, name in there)
        self.grants = {name: each for name, each in self.grants.items() if each.robot}


@pytest.fixture
def node():
    return Node()


@pytest.fixture
def grants(node):
    return ChargerGrants(node)


def says(robot, charger="", grant=0, *, there=False):
    return RobotStatus(
        robot,
        RobotState.CHARGING,
        Pose(0.0, 0.0),
        0.2,
        charger=charger,
        grant=grant,
        at_charger=there,
    )


def test_who_asks_first_gets_the_charger(node, grants):
    grants.hear(says("robot1", "east"))
    grants.hear(says("robot2", "east"))

    assert node.grants == {"east": Grant("east", "robot1", 8)}


def test_a_repeated_wish_changes_nothing(node, grants):
    grants.hear(says("robot1", "east"))
    grants.hear(says("robot1", "east", 8))

    assert node.version == 8


def test_a_robot_gives_a_charger_up_once_it_knows_that_it_has_it(node, grants):
    grants.hear(says("robot1", "east"))
    grants.hear(says("robot1"))
    late = dict(node.grants)
    grants.hear(says("robot1", grant=8))

    assert late == {"east": Grant("east", "robot1", 8)}
    assert node.grants == {}


def test_a_robot_gets_another_charger_only_when_it_has_given_up_the_first(node, grants):
    grants.hear(says("robot1", "east"))
    grants.hear(says("robot1", "west"))
    before = set(node.grants)
    grants.hear(says("robot1", "west", 8))

    assert before == {"east"}
    assert set(node.grants) == {"west"}


def test_the_hive_knows_who_stands_at_a_charger(node, grants):
    grants.hear(says("robot1", "east"))
    grants.hear(says("robot1", "east", 8, there=True))
    arrived = node.grants["east"]
    grants.hear(says("robot1", "east", 8))

    assert arrived == node.grants["east"] == Grant("east", "robot1", 9, there=True)


def test_a_lost_robot_keeps_only_the_charger_at_which_it_stands(node, grants):
    grants.hear(says("robot1", "east"))
    grants.hear(says("robot2", "west", there=True))

    grants.look(is_lost=lambda _: True, is_gone=lambda _: False)

    assert set(node.grants) == {"west"}


def test_a_robot_that_is_gone_keeps_no_charger(node, grants):
    grants.hear(says("robot1", "east", there=True))
    grants.hear(says("robot2", "west", there=True))

    grants.look(is_lost=lambda _: True, is_gone=lambda robot: robot == "robot1")

    assert set(node.grants) == {"west"}


def test_chargers_of_robots_that_are_heard_stay_theirs(node, grants):
    grants.hear(says("robot1", "east"))

    grants.look(is_lost=lambda robot: robot != "robot1", is_gone=lambda _: False)

    assert set(node.grants) == {"east"}
