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
        self.make_room = ()

    def ask_for_room(self, robots):
        self.make_room = robots

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


def at_charger(robot, charge, state=RobotState.IDLE):
    return RobotStatus(robot, state, Pose(0.0, 0.0), charge, charger=robot, at_charger=True)


def test_as_many_robots_are_asked_for_room_as_others_wait_and_the_fullest_first(node, grants):
    stand = [at_charger("robot1", 0.7), at_charger("robot2", 0.9), at_charger("robot3", 0.8)]
    asked = []
    for waiting in ([], [says("robot4")], [says("robot4"), says("robot5")], []):
        grants.ask_for_room([*stand, *waiting])
        asked.append(node.make_room)

    assert asked == [(), ("robot2",), ("robot2", "robot3"), ()]


def test_robots_that_charge_or_work_are_not_asked_for_room(node, grants):
    charges = at_charger("robot1", 0.5, RobotState.CHARGING)
    leaves = at_charger("robot2", 0.9, RobotState.BUSY)
    grants.ask_for_room([charges, leaves, says("robot3")])

    assert node.make_room == ()


def test_a_robot_that_asks_for_a_free_charger_needs_no_room(node, grants):
    grants.ask_for_room([at_charger("robot1", 0.9), says("robot2", "east")])

    assert node.make_room == ()


def test_a_robot_that_asks_for_the_charger_of_another_waits(node, grants):
    stands = at_charger("robot1", 0.9)
    grants.hear(stands)
    grants.ask_for_room([stands, says("robot2", "robot1")])

    assert node.make_room == ("robot1",)
