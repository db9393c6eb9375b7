# SPDX-License-Identifier: BSD-3-Clause
"""Robots of which a part uses another map than the leader."""

from blackboard.domain.bid import MAX_COST
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.robot.maps_in_use import MapsInUse
from hive_common.map_id import NO_MAP, MapId
from hive_common.pose import Pose
from hive_lab.virtual.harness import STEP, RobotHarness

HALL, SHELF = MapId("hall", "01"), MapId("shelf", "02")
GO = Task("T1", TaskType.GA, (Pose(6.0, 0.0),))
NEXT = Task("T2", TaskType.GA, (Pose(0.0, 0.0),))


def test_a_robot_all_of_whose_parts_use_the_leaders_map_has_no_trouble():
    maps = MapsInUse()
    maps.note("robot_node", HALL)
    maps.note("move_base", MapId("", HALL.checksum))

    assert maps.trouble(HALL) == ""
    assert maps.told(HALL) == HALL


def test_the_parts_that_use_another_map_are_named_with_it():
    maps = MapsInUse()
    maps.note("robot_node", SHELF)
    maps.note("robot_node", HALL)
    maps.note("move_base", MapId("", SHELF.checksum))
    one = maps.trouble(HALL)
    maps.note("amcl", MapId("", SHELF.checksum))

    assert one == "its move_base uses map 'shelf' (02), and the leader uses map 'hall' (01)"
    assert maps.trouble(HALL).startswith("its move_base and amcl use map 'shelf' (02), ")
    assert maps.told(HALL) == SHELF


def test_where_nobody_knows_the_leaders_map_none_is_wrong():
    maps = MapsInUse()
    maps.note("robot_node", HALL)

    assert maps.trouble(NO_MAP) == ""
    assert maps.told(NO_MAP) == HALL
    assert MapsInUse().told(HALL) == NO_MAP


def test_a_robot_that_bids_without_a_map_tells_the_one_by_which_it_drives():
    maps = MapsInUse()
    maps.note("robot_node", NO_MAP)
    maps.note("move_base", HALL)

    assert maps.told(NO_MAP) == HALL


def test_parts_without_end_take_no_memory():
    maps = MapsInUse()
    maps.note("robot_node", HALL)
    for number in range(100):
        maps.note(f"part{number}", SHELF)

    assert "part14" in maps.trouble(HALL)
    assert "part15" not in maps.trouble(HALL)


class Beside:
    """The member beside a robot, which hears a leader on a map."""

    hive = ""
    leader = carriers = None
    leaders_map = HALL

    def obeys(self, _hive, _epoch):
        return True

    def follow(self, _hear):
        """Say nothing: no task has changed."""

    def show(self):
        """Say nothing."""


def test_a_robot_on_another_map_bids_on_nothing_says_why_and_does_what_it_has():
    harness = RobotHarness(hive_filter=Beside())
    harness.robot.maps.note("robot_node", HALL)
    harness.order(GO)
    able = harness.bids(NEXT).bids[0].cost
    harness.robot.maps.note("amcl", SHELF)
    unable, status = harness.bids(NEXT).bids[0], harness.robot.status
    harness.wait(STEP + 1.0)

    assert able < MAX_COST
    assert (unable.cost, unable.reason) == (MAX_COST, status.reason)
    assert status.reason == "its amcl uses map 'shelf' (02), and the leader uses map 'hall' (01)"
    assert status.map == SHELF
    assert harness.said("task_state")[-1].state is TaskState.DONE


def test_a_robot_that_uses_the_leaders_map_again_bids_again():
    harness = RobotHarness(hive_filter=Beside())
    harness.robot.maps.note("robot_node", SHELF)
    assert harness.bids(NEXT).bids[0].cost == MAX_COST

    harness.robot.maps.note("robot_node", HALL)

    assert harness.bids(NEXT).bids[0].cost < MAX_COST
    assert harness.robot.status.map == HALL
