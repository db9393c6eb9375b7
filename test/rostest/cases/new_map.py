# SPDX-License-Identifier: BSD-3-Clause
"""All use another map while they drive, and whoever does not is named and gets no tasks."""

import contextlib
import json
from dataclasses import replace

import pytest
import rosgraph
import rospy
from blackboard.msg import TaskMsg, TaskState
from hive_operator import Operator, slow_motion, task
from launching import kill, pid_of, run_hive, wait_until_empty
from robot_description.msg import MapInUse, TrafficState

from hive_common.map_file import load_map, save_map
from hive_common.map_id import checksum_of

ROBOTS = ("robot1", "robot2")
WEST, EAST = (6.5, 3.2, 0.0), (13.5, 3.2, 0.0)
"""On both sides of the lower door; the upper door is the other way between them."""
DOOR = (9.6, 2.4, 10.4, 4.0)
"""The lower door: x and y of the lower left and the upper right corner [m]."""
LOAD = 58.0
"""What robot1 can carry and robot2 too [kg]."""


@pytest.fixture(scope="module")
def operator():
    """The operator's program, once both robots were heard and traffic is planned for them."""
    rospy.init_node("operator")
    operator = Operator(robots=ROBOTS)
    planned = {}
    rospy.Subscriber(
        "/traffic_state", TrafficState, lambda m: planned.update(dict.fromkeys(m.robots))
    )
    operator.expect(
        lambda: set(ROBOTS) <= set(operator.robots) and set(ROBOTS) <= set(planned),
        "a status of both robots, and a traffic planner that plans for them",
        lambda: (sorted(operator.robots), sorted(planned)),
    )
    return operator


@pytest.fixture(scope="module")
def shut_door(tmp_path_factory):
    """Return the file of a map of the lab whose lower door is walled up."""
    lab = load_map("lab")
    cells = lab.cells.copy()
    left, low, right, high = (round(number / lab.resolution) for number in DOOR)
    cells[low:high, left:right] = 100
    folder = tmp_path_factory.mktemp("maps")
    save_map(replace(lab, cells=cells), folder / "shut_door")
    return folder / "shut_door.yaml"


def was_in_door(operator, robot, since):
    """Return whether a robot has been in the lower door since a time [s]."""
    left, low, right, high = DOOR
    return any(
        stamp > since and left < x < right and low < y < high
        for stamp, x, y in list(operator.tracks[robot])
    )


def checksums():
    """Return the checksum of the map that the leader uses, and of that of each robot."""
    shown = run_hive("map", "show", "--json")
    assert shown.returncode == 0, shown.stderr
    used = json.loads(shown.stdout)
    return [used["leader"]["checksum"], *(used["robots"][name]["checksum"] for name in ROBOTS)]


def is_another_than(process):
    """Return whether a map server answers that is not the process of an id."""
    with contextlib.suppress(OSError, rosgraph.MasterException):
        return pid_of("/map_server") != process
    return False


def test_at_first_all_use_the_map_of_the_launch(operator):  # noqa: ARG001
    assert checksums() == [checksum_of(load_map("lab"))] * 3
    assert "uses map 'lab' (" in run_hive("map", "show").stdout


def test_robots_under_way_plan_anew_on_the_new_map_and_do_their_tasks(operator, shut_door):
    with slow_motion():
        operator.post(task("A1", TaskMsg.GAB, WEST, EAST, payload=LOAD))
        operator.until("A1", TaskState.STARTED)
        loaded = run_hive("map", "load", str(shut_door), "--yes")
    began, robot = rospy.get_time(), operator.until("A1", TaskState.STARTED).robot_id
    ended = operator.follow("A1")

    assert loaded.returncode == 0, loaded.stderr
    assert "robot1, robot2: map 'shut_door' (" in loaded.stderr
    assert ended.state == TaskState.DONE
    assert not was_in_door(operator, robot, began)
    assert checksums() == [checksum_of(load_map(str(shut_door)))] * 3
    assert operator.collisions == 0


def test_a_map_server_that_is_killed_is_started_again_with_the_map_that_was_loaded(operator):
    before = checksums()
    heard = []
    killed = pid_of("/map_server")
    kill("/map_server")
    wait_until_empty(lambda: [] if is_another_than(killed) else ["another map server"])
    rospy.Subscriber("/map_in_use", MapInUse, heard.append)
    operator.post(task("K1", TaskMsg.GA, WEST))

    assert operator.follow("K1").state == TaskState.DONE
    wait_until_empty(lambda: [] if heard else ["which map it serves"])
    assert (heard[-1].name, heard[-1].checksum) == ("shut_door", before[0])
    assert checksums() == before


def test_a_place_that_is_a_wall_on_the_new_map_is_refused(operator):
    operator.post(task("B1", TaskMsg.GA, (10.0, 3.2, 0.0)))

    assert operator.follow("B1").state == TaskState.REJECTED


def test_a_map_that_cannot_be_read_is_refused_and_everybody_keeps_theirs(operator, tmp_path):  # noqa: ARG001
    before = checksums()
    (tmp_path / "odd.yaml").write_text("image: none.pgm\nresolution: 0.05\n")
    by_command = run_hive("map", "load", str(tmp_path / "odd.yaml"), "--yes")

    assert by_command.returncode == 2
    assert by_command.stderr.count("\n") == 1
    assert checksums() == before


def test_a_robot_of_which_a_part_uses_another_map_is_named_and_gets_no_tasks(operator):
    told = rospy.Publisher("/robot2/map_in_use", MapInUse, queue_size=1, latch=True)
    right = checksums()[0]
    told.publish(MapInUse("camera", "", "0badcafe"))
    operator.expect(
        lambda: operator.robots["robot2"].map_checksum == "0badcafe",
        "a status of robot2 that tells of the other map",
        lambda: operator.robots["robot2"],
    )
    shown = run_hive("map", "show").stdout
    operator.post(task("C1", TaskMsg.GA, (3.0, 4.0, 0.0)))
    done = operator.follow("C1")
    refusal = operator.bids["C1"]["robot2"][-1].reason
    told.publish(MapInUse("camera", "", ""))
    wait_until_empty(lambda: set(checksums()) - {right})
    operator.post(task("C2", TaskMsg.GA, (3.0, 4.0, 0.0)))

    assert "0badcafe  not the leader's: gets no tasks" in shown
    assert (done.state, done.robot_id) == (TaskState.DONE, "robot1")
    assert refusal == (
        f"its camera uses map 0badcafe, and the leader uses map 'shut_door' ({right})"
    )
    assert operator.follow("C2").state == TaskState.DONE
    assert operator.bids["C2"]["robot2"][-1].reason == ""


def test_the_first_map_is_loaded_again_by_its_name_and_the_door_is_open(operator):
    loaded = run_hive("map", "load", "lab")
    began = rospy.get_time()
    operator.post(task("D1", TaskMsg.GAB, EAST, WEST, payload=LOAD))
    done = operator.follow("D1")

    assert loaded.returncode == 0, loaded.stderr
    assert done.state == TaskState.DONE
    assert was_in_door(operator, done.robot_id, began)
