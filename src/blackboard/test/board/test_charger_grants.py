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
        self.changes = 0
        self.grants = {}

    def give_chargers(self, grants):
        self.changes += bool(grants)
        self.grants.update({each.charger: each for each in grants})
        self.grants = {name: each for name, each in self.grants.items() if each.robot}


@pytest.fixture
def node():
    return Node()


@pytest.fixture
def grants(node):
    return ChargerGrants(node)


def says(robot, charger="", since=1.0, *, there=False):
    return RobotStatus(
        robot,
        RobotState.CHARGING,
        Pose(0.0, 0.0),
        0.2,
        charger=charger,
        at_charger=there,
        charger_since=since,
    )


def test_who_asks_first_gets_the_charger(node, grants):
    grants.hear(says("robot1", "east", 1.5))
    grants.hear(says("robot2", "east", 1.0))

    assert node.grants == {"east": Grant("east", "robot1", 1.5)}


def test_a_repeated_request_changes_nothing(node, grants):
    grants.hear(says("robot1", "east"))
    grants.hear(says("robot1", "east"))

    assert node.changes == 1


def test_a_robot_that_asks_anew_for_its_charger_gets_a_new_answer(node, grants):
    grants.hear(says("robot1", "east", 1.0))
    grants.hear(says("robot1", "east", 3.0))

    assert node.grants == {"east": Grant("east", "robot1", 3.0)}


def test_a_robot_gives_its_charger_up_but_not_by_a_status_from_before(node, grants):
    grants.hear(says("robot1", "east", 2.0))
    grants.hear(says("robot1", "", 1.0))
    late = dict(node.grants)
    grants.hear(says("robot1", "", 3.0))

    assert late == {"east": Grant("east", "robot1", 2.0)}
    assert node.grants == {}


def test_a_robot_that_asks_for_another_charger_gives_up_the_first(node, grants):
    grants.hear(says("robot1", "east", 2.0))
    grants.hear(says("robot1", "west", 1.0))
    late = set(node.grants)
    grants.hear(says("robot1", "west", 3.0))

    assert late == {"east"}
    assert set(node.grants) == {"west"}


def test_the_hive_knows_who_stands_at_a_charger(node, grants):
    grants.hear(says("robot1", "east", 1.0))
    grants.hear(says("robot1", "east", 2.0, there=True))
    arrived = node.grants["east"]
    grants.hear(says("robot1", "east", 1.0))

    assert arrived == node.grants["east"] == Grant("east", "robot1", 2.0, there=True)


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
