# SPDX-License-Identifier: BSD-3-Clause
import pytest

from blackboard.domain.task import TaskType
from fleet_manager.config.fleet_file import read_fleet
from fleet_manager.config.places import places_of
from fleet_manager.config.scenario import read_scenario, with_free_ids
from hive_common.errors import FileError
from hive_common.pose import Pose
from hive_common.resources import names_in
from robot_description.models import load_model

GOOD = """\
description: Two tasks.
world: lab
fleet: lab
tasks:
  - {id: late, type: GA, goals: [[1, 2]], after: 5}
  - {id: soon, type: GPAB, goals: [shelf 1 pick-up, [3, 4, 1.57]], payload: 2, priority: 7}
"""


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "mine.yaml"
        path.write_text(text, encoding="utf-8")
        return str(path)

    return write


def is_doable(task, models):
    kind = TaskType(task.type)
    return any(
        kind.name in model.capabilities
        and task.payload <= model.payload
        and (not kind.picks or task.payload <= model.arm.payload)
        for model in models
    )


@pytest.mark.parametrize("name", names_in("fleet_manager", "scenarios"))
def test_every_task_of_the_scenarios_can_be_done_by_a_robot_of_their_fleet(name):
    scenario = read_scenario(name)
    models = [load_model(robot.model) for robot in read_fleet(scenario.fleet).robots]

    assert [p.task.id for p in scenario.tasks if not is_doable(p.task, models)] == []


def test_the_demo_has_at_least_twelve_tasks_of_all_types_with_mixed_priorities_and_payloads():
    tasks = [planned.task for planned in read_scenario("demo").tasks]

    assert len(tasks) >= 12
    assert {task.type for task in tasks} == set(TaskType)
    assert len({task.priority for task in tasks}) >= 5
    assert len({task.payload for task in tasks}) >= 5


def test_tasks_are_in_the_order_in_which_they_are_posted(written):
    scenario = read_scenario(written(GOOD))

    assert [planned.task.id for planned in scenario.tasks] == ["soon", "late"]
    assert scenario.name == "mine"


def test_a_goal_may_be_a_place_of_the_world(written):
    task = read_scenario(written(GOOD)).tasks[0].task

    assert task.goals == (places_of("lab")["shelf 1 pick-up"], Pose(3.0, 4.0, 1.57))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("type: GA,", "type: GO,", ["/mine.yaml:5: tasks[0].type", "'GO'", "GA | GAB"]),
        ("[shelf 1 pick-up, [3, 4, 1.57]]", "[[3, 4]]", [":6: tasks[1].goals", "at least 2"]),
        ("shelf 1 pick-up", "attic", [":6: tasks[1].goals[0]", "'attic'", "charger 1"]),
        ("[1, 2]", "[1]", [":5: tasks[0].goals[0]", "[x, y]"]),
        ("id: late", "id: soon", [":6: tasks[1].id", "'soon'", "tasks[0]"]),
        ("id: late", "id: too late", [":5: tasks[0].id", "without spaces"]),
        ("priority: 7", "priority: 11", [":6: tasks[1].priority", "11", "0..10"]),
        ("payload: 2", "payload: -2", [":6: tasks[1].payload", "-2", "0..1e+06"]),
        ("after: 5", "after: soon", [":5: tasks[0].after", "soon", "seconds"]),
        ("fleet: lab\n", "", [":1: fleet: missing"]),
    ],
)
def test_a_mistake_is_one_line_with_file_line_key_and_what_is_allowed(written, old, new, words):
    with pytest.raises(FileError) as caught:
        read_scenario(written(GOOD.replace(old, new)))

    said = str(caught.value)
    assert "\n" not in said
    for word in words:
        assert word in said


def test_a_world_that_is_not_there_is_said(written):
    with pytest.raises(FileError, match="world 'moon': not known; allowed: lab, warehouse"):
        read_scenario(written(GOOD.replace("world: lab", "world: moon")))


def test_ids_stay_where_they_are_free_and_get_one_ending_all_where_not(written):
    scenario = read_scenario(written(GOOD))

    def ids(taken):
        return [planned.task.id for planned in with_free_ids(scenario, taken).tasks]

    assert ids({"other"}) == ["soon", "late"]
    assert ids({"late"}) == ["soon-2", "late-2"]
    assert ids({"late", "soon-2"}) == ["soon-3", "late-3"]


def test_a_task_may_say_that_it_is_not_to_be_split(written):
    scenario = read_scenario(written(GOOD.replace("after: 5", "after: 5, split: false")))

    assert [planned.task.no_split for planned in scenario.tasks] == [False, True]


def test_whether_a_task_may_be_split_is_true_or_false(written):
    with pytest.raises(FileError, match=r"tasks\[0\]\.split"):
        read_scenario(written(GOOD.replace("after: 5", "after: 5, split: seldom")))
