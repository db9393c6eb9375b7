# SPDX-License-Identifier: BSD-3-Clause
import contextlib
import json
import math
import re
from dataclasses import replace

import pytest

from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskRecord, TaskUpdate
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.cli.context import CliContext
from fleet_manager.cli.main import run
from fleet_manager.errors import NoHiveError
from fleet_manager.testing import FakeHive, FakeLink, Keyboard
from hive_common.pose import Pose


class Terminal:
    """The command line with a fake hive behind it."""

    def __init__(self, capsys):
        self.link = FakeLink()
        self.hive = FakeHive(self.link)
        self.hive.start()
        self._capsys = capsys

    def __call__(self, *words):
        """Run `hive` with words; return exit code, stdout, stderr."""
        code = run(CliContext(lambda _record: contextlib.nullcontext(self.link)), list(words))
        out, err = self._capsys.readouterr()
        return code, out, err


@pytest.fixture
def terminal(capsys):
    return Terminal(capsys)


def test_add_prints_the_id_alone_so_that_a_script_can_use_it(terminal):
    code, out, _ = terminal(
        "add", "gab", "--goal", "3,-4", "--goal", "-8,2,90", "--priority", "5", "--payload", "20"
    )

    task = terminal.link.posted[0]
    assert (code, out) == (0, f"{task.id}\n")
    assert task.goals == (Pose(3.0, -4.0), Pose(-8.0, 2.0, math.radians(90)))
    assert (task.priority, task.payload) == (5, 20.0)


def test_add_can_ask_that_a_task_is_never_split(terminal):
    terminal("add", "GA", "--goal", "1,2", "--no-split")
    terminal.hive.start()
    terminal("add", "GA", "--goal", "1,2")

    assert [task.no_split for task in terminal.link.posted] == [True, False]


def tell_of_robots(terminal, carries=100.0):
    """Have one robot tell what it carries [kg]."""
    terminal.link.robots = {"robot1"}
    told = (carries, carries, -1.0, -1.0) if carries else ()
    terminal.link.say(RobotStatus("robot1", RobotState.IDLE, Pose(1.0, 2.0), 1.0, carries=told))


def test_add_says_before_it_posts_that_a_task_will_be_split(terminal, capsys):
    tell_of_robots(terminal)
    said = []
    answer = terminal.link.on_post
    terminal.link.on_post = lambda task: [said.append(capsys.readouterr().err), answer(task)]

    code, out, _ = terminal("add", "GA", "--goal", "1,2", "--payload", "500", "--id", "T7")

    assert (code, out) == (0, "T7\n")
    assert said[0] == (
        "no robot in service can carry 500 kg (robot1 carries most: 100 kg); "
        "the hive will split T7 into 5 parts\n"
    )


@pytest.mark.parametrize("carries", [500.0, 0.0], ids=["one can", "it does not tell"])
def test_add_says_nothing_of_what_is_not_split_or_not_certain(terminal, carries):
    tell_of_robots(terminal, carries)

    _, _, err = terminal("add", "GA", "--goal", "1,2", "--payload", "500")

    assert err == ""


def test_run_says_before_each_task_that_it_will_be_split(terminal, tmp_path):
    scenario = tmp_path / "heavy.yaml"
    task = "{id: T7, type: GA, goals: [[1, 2]], payload: 500}"
    scenario.write_text(f"description: x\nworld: lab\nfleet: lab\ntasks: [{task}]\n")
    terminal.hive.start()
    tell_of_robots(terminal)

    code, _, err = terminal("run", str(scenario))

    assert code == 0
    assert "the hive will split T7 into 5 parts" in err


def test_two_tasks_without_ids_get_different_ones(terminal):
    terminal("add", "GA", "--goal", "1,2")
    terminal.hive.start()
    terminal("add", "GA", "--goal", "1,2")

    assert list(terminal.hive.records) == ["T1", "T2"]


def test_add_that_waits_ends_with_the_task(terminal):
    terminal("add", "GA", "--goal", "1,2", "--id", "T1")
    terminal.link.say(TaskUpdate("T1", TaskState.DONE, "robot1"), after=3)

    code, _, err = terminal("add", "GA", "--goal", "1,2", "--id", "T1", "--wait")

    assert code == 0
    assert "task T1 is done by robot1" in err


def test_a_failed_task_is_exit_1_with_its_reason(terminal):
    terminal("add", "GA", "--goal", "1,2", "--id", "T1")
    terminal.link.say(TaskUpdate("T1", TaskState.FAILED, "robot1", reason="no way to A"), after=3)

    code, _, err = terminal("add", "GA", "--goal", "1,2", "--id", "T1", "--wait")

    assert code == 1
    assert "T1 FAILED (no way to A)" in err.splitlines()[-1]


def test_a_rejected_task_is_exit_1_with_its_reason(terminal):
    rejection = TaskUpdate("T1", TaskState.REJECTED, reason="goal A is inside a wall")
    terminal.link.on_post = lambda _task: terminal.link.say(rejection)

    code, out, err = terminal("add", "GA", "--goal", "1,2", "--id", "T1")

    assert (code, out) == (1, "")
    assert err == "hive: task T1 was rejected: goal A is inside a wall\n"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["add", "GAX", "--goal", "1,2"], "'GA', 'GAB', 'GPA', 'GPAB'"),
        (["add", "GAB", "--goal", "1,2"], "GAB needs --goal at least 2 times, not 1"),
        (["add", "GA", "--goal", "1"], "there is no place '1'; there are: none; allowed too: x,y"),
        (["add", "GA", "--goal", "1,nan"], "allowed: x,y or x,y,heading"),
        (["add", "GA", "--goal", "1,2", "--priority", "11"], "0<=x<=10"),
        (["add", "GA", "--goal", "1,2", "--payload", "-1"], "x>=0"),
        (["add", "GA", "--goal", "1,2", "--timeout", "3"], "--wait"),
        (["run", "nothing"], "allowed: demo, smoke, warehouse"),
        (["demo", "--rtf", "0"], "0.1<=x<=20"),
        (["demo", "--scenario", "nothing"], "allowed: demo, smoke, warehouse"),
        (["fly"], "No such command 'fly'"),
    ],
)
def test_a_mistake_in_the_words_is_one_line_and_exit_2(terminal, words, said):
    code, out, err = terminal(*words)

    assert (code, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1
    assert terminal.link.posted == []


def test_no_ros_master_is_one_line_and_exit_3(capsys):
    def connect(_record):
        raise NoHiveError("no ROS master answers at here")

    code = run(CliContext(connect), ["tasks"])

    assert (code, capsys.readouterr().err) == (3, "hive: no ROS master answers at here\n")


def test_ctrl_c_is_quiet(capsys):
    def connect(_record):
        raise KeyboardInterrupt

    code = run(CliContext(connect), ["watch"])

    out, err = capsys.readouterr()
    assert (code, out, err.strip()) == (130, "", "")


def test_tasks_shows_what_is_open_and_with_all_what_has_ended(terminal):
    terminal("add", "GA", "--goal", "1,2", "--id", "T1")
    terminal("add", "GA", "--goal", "1,2", "--id", "T2")
    terminal.hive.change("T1", TaskState.DONE, "robot1")
    terminal.hive.start()

    _, open_ones, _ = terminal("tasks")
    terminal.hive.start()
    _, every_one, _ = terminal("tasks", "--all", "--json")

    assert [line.split()[0] for line in open_ones.splitlines()] == ["TASK", "T2"]
    assert [task["state"] for task in json.loads(every_one)] == ["DONE", "WAITING"]


def test_robots_are_sorted_by_name(terminal):
    terminal.hive.start()
    for name in ("robot2", "robot1"):
        terminal.link.say(RobotStatus(name, RobotState.IDLE, Pose(1.0, 2.0), 1.0))

    code, out, _ = terminal("robots")

    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == ["ROBOT", "robot1", "robot2"]


def test_a_robot_that_the_leader_no_longer_hears_is_offline_with_what_it_was_last(terminal):
    dead = RobotStatus(
        "robot2", RobotState.OFFLINE, Pose(3.0, 4.0), 0.5, reason="not heard for 9 s"
    )
    beat = Heartbeat(1, "/blackboard", offline=("robot2",))
    terminal.link.say(RobotStatus("robot1", RobotState.IDLE, Pose(1.0, 2.0), 1.0))
    terminal.link.say(beat, after=0.1)
    terminal.link.say(dead, after=0.6)

    code, out, _ = terminal("robots")

    assert code == 0
    shown = "robot2 OFFLINE 50% 0 kg 3.0, 4.0 – 0 not heard for 9 s"
    assert out.splitlines()[2].split() == shown.split()


def test_robots_without_a_leader_are_shown_and_the_exit_code_says_it(terminal):
    terminal.link.reconnect()
    terminal.link.say(RobotStatus("robot1", RobotState.IDLE, Pose(1.0, 2.0), 1.0))

    code, out, error = terminal("robots")

    assert code == 3
    assert "robot1" in out
    assert error == "no leader is heard\n"


def test_why_there_is_no_leader_is_said_where_members_know_it(terminal):
    terminal.link.reconnect()
    terminal.link.wrong = ("3 of 5 members have to run",)
    terminal.link.say(RobotStatus("robot1", RobotState.IDLE, Pose(1.0, 2.0), 1.0))

    _, _, error = terminal("robots")

    assert error == "no leader is heard; 3 of 5 members have to run\n"


def test_tasks_without_a_leader_are_shown_with_the_age_of_the_list(terminal):
    terminal("add", "GA", "--goal", "1,2", "--id", "T1")
    terminal.link.reconnect()
    terminal.link.say(TaskList(1, 1, (TaskRecord(Task("T1", TaskType.GA, (Pose(1, 2),))),)))

    code, out, error = terminal("tasks")

    assert code == 3
    assert out.splitlines()[1].split()[0] == "T1"
    assert (
        error
        == "no leader is heard; tasks wait. The list is the last one that is known, 2 s old\n"
    )


def test_the_time_until_a_task_is_done_counts_from_its_prediction(terminal):
    now = terminal.link.hive_time()
    task = Task("T1", TaskType.GA, (Pose(1, 2),), posted=now - 60)
    going = TaskRecord(task, TaskState.STARTED, "robot1", eta=56.0, predicted_at=now - 20)
    late = replace(going, task=replace(task, id="T2"), predicted_at=now - 90)
    queued = replace(late, task=replace(task, id="T3"), state=TaskState.ASSIGNED)
    terminal.link.reconnect()
    terminal.link.say(Heartbeat(1, "/blackboard"))
    terminal.link.say(TaskList(1, 9, (going, late, queued)))

    _, out, _ = terminal("tasks")

    shown = [line.split("0/1")[1].strip() for line in out.splitlines()[1:]]
    assert shown == ["36 s", "late by 34 s", "–"]


def test_events_tells_what_the_first_list_holds_as_earlier_and_all_else_with_a_time(terminal):
    task = Task("T1", TaskType.GA, (Pose(1, 2),))
    listed = TaskRecord(task, TaskState.ASSIGNED, "robot1")
    later = replace(listed, task=replace(task, id="T2"))
    terminal.link.reconnect()
    terminal.link.say(RobotStatus("robot1", RobotState.IDLE, Pose(1.0, 2.0), 1.0))
    terminal.link.say(TaskList(1, 1, (listed,)), after=0.1)
    terminal.link.say(TaskUpdate("T1", TaskState.STARTED, "robot1", epoch=1), after=0.2)
    terminal.link.say(TaskList(1, 2, (listed, later)), after=0.3)
    terminal.link.receive = until_ctrl_c(terminal.link)

    code, out, _ = terminal("events")

    assert code == 130
    assert re.sub(r"\d\d:\d\d:\d\d", "at once ", out).splitlines() == [
        "at once   robot1 is ready, battery 100%",
        "earlier   task T1 is on the list: GA (1.0, 2.0), 0 kg, priority 0",
        "earlier   task T1 is on the list of robot1",
        "at once   task T1 is under way by robot1, 0 of 1 steps done",
        "at once   task T2 is on the list: GA (1.0, 2.0), 0 kg, priority 0",
        "at once   task T2 is on the list of robot1",
    ]


def until_ctrl_c(link):
    """Return what receives all that a link has to tell, and is then interrupted."""
    receive = link.receive

    def interrupted(timeout):
        message = receive(timeout)
        if message is None:
            raise KeyboardInterrupt
        return message

    return interrupted


def test_cancel_takes_a_task_off(terminal):
    terminal("add", "GA", "--goal", "1,2", "--id", "T1")
    terminal.hive.start()

    code, _, _ = terminal("cancel", "T1")

    assert code == 0
    assert terminal.hive.records["T1"].state is TaskState.CANCELLED


def test_run_posts_a_scenario_and_again_with_new_ids(terminal):
    terminal.hive.start()
    first, _, _ = terminal("run", "smoke")
    terminal.hive.start()
    second, _, _ = terminal("run", "smoke")

    assert (first, second) == (0, 0)
    assert list(terminal.hive.records) == ["S1", "S2", "S3", "S4", "S1-2", "S2-2", "S3-2", "S4-2"]


def test_help_shows_examples_and_exit_codes(terminal):
    code, out, _ = terminal("--help")

    assert code == 0
    assert "hive add GAB --goal 3,4 --goal 8,2 --priority 5 --payload 20" in out
    assert "no ROS master or no blackboard answers" in out


def test_add_takes_places_of_the_hive_by_name_with_a_heading_of_their_own_or_another(terminal):
    terminal.link.known_places = {"dock": Pose(1.0, 2.0, 0.5), "shelf-1": Pose(3.0, 4.0, 0.25)}

    code, _, _ = terminal("add", "GAB", "--goal", "dock", "--goal", "shelf-1,180")

    assert code == 0
    assert terminal.link.posted[0].goals == (Pose(1.0, 2.0, 0.5), Pose(3.0, 4.0, math.pi))


@pytest.mark.parametrize(
    ("places", "known"),
    [({"dock": Pose(1, 2), "bay": Pose(3, 4)}, "bay, dock"), ({}, "none")],
)
def test_a_place_that_is_not_there_is_named_with_those_that_are(terminal, places, known):
    terminal.link.known_places = places

    code, _, error = terminal("add", "GA", "--goal", "dok")

    assert code == 2
    also = "allowed too: x,y or x,y,heading [m,m,°]"
    assert error == f"hive: there is no place 'dok'; there are: {known}; {also}\n"
    assert terminal.link.posted == []


@pytest.mark.parametrize(
    "goal", ["3", "3,4,5,6", "3,4,361", "3,x", "dock,1,2", "", "3,4,", "nan,1"]
)
def test_what_is_no_goal_is_refused_with_what_is_allowed(terminal, goal):
    code, _, error = terminal("add", "GA", "--goal", goal)

    assert code == 2
    assert "x,y,heading [m,m,°]" in error
    assert error.count("\n") == 1
    assert terminal.link.posted == []


@pytest.mark.parametrize("name", ["Dock, north", "12", "aisle,3"])
def test_a_place_may_have_a_comma_in_its_name_or_be_called_by_a_number(terminal, name):
    terminal.link.known_places = {name: Pose(1.0, 2.0, 0.5)}

    terminal("add", "GA", "--goal", name)

    assert terminal.link.posted[0].goals == (Pose(1.0, 2.0, 0.5),)


def test_a_heading_may_follow_a_name_with_a_comma(terminal):
    terminal.link.known_places = {"Dock, north": Pose(1.0, 2.0, 0.5)}

    terminal("add", "GA", "--goal", "Dock, north,180")

    assert terminal.link.posted[0].goals == (Pose(1.0, 2.0, math.pi),)


LOADED = TaskRecord(
    Task("T1", TaskType.GPAB, (Pose(1, 2), Pose(3, 4)), payload=2.0),
    *(TaskState.STARTED, "robot3", 2),
)


def test_cancelling_a_task_whose_load_is_on_board_says_first_what_becomes_of_it(terminal):
    terminal.hive.records["T1"] = LOADED
    terminal.hive.start()

    code, _, error = terminal("cancel", "T1")

    assert code == 0
    assert error.startswith("robot3 carries the load of T1 (2 kg): it stops where it is")
    assert error.endswith("(hive robot robot3 in)\ntask T1 is cancelled\n")


def test_cancelling_a_task_that_was_split_says_what_becomes_of_the_load_of_each_part(terminal):
    whole = replace(LOADED, robot="", step=0, parts=3)
    first, second, third = (
        replace(LOADED, task=replace(LOADED.task, id=f"T1.{number}"), robot=f"robot{number}")
        for number in (1, 2, 3)
    )
    done = replace(second, state=TaskState.DONE)
    terminal.hive.records = {each.task.id: each for each in (whole, first, done, third)}
    terminal.hive.start()

    code, _, error = terminal("cancel", "T1")

    *loads, cancelled = error.splitlines()
    assert code == 0
    assert [each.partition(":")[0] for each in loads] == [
        "robot1 carries the load of T1.1 (2 kg)",
        "robot3 carries the load of T1.3 (2 kg)",
    ]
    assert cancelled == "task T1 is cancelled"


CANCEL = ("cancel", "T1")
TAKE_OUT = ("robot", "robot3", "out")


def load_on_board(terminal):
    """Have robot3 carry the load of T1, and obey."""
    terminal.hive.records["T1"] = LOADED
    terminal.hive.start()
    robot = RobotStatus("robot3", RobotState.BUSY, Pose(1, 2), 1.0)
    terminal.link.say(robot)
    terminal.link.on_set_state = lambda _robot, _word: terminal.link.say(
        replace(robot, state=RobotState.DEFECT)
    )


@pytest.mark.parametrize("words", [CANCEL, TAKE_OUT])
@pytest.mark.parametrize("answer", ["n\n", "\n", ""], ids=["no", "nothing", "end of input"])
def test_a_person_who_does_not_say_yes_to_the_consequences_changes_nothing(
    terminal, monkeypatch, words, answer
):
    load_on_board(terminal)
    monkeypatch.setattr("sys.stdin", Keyboard(answer))

    code, _, error = terminal(*words)

    assert code == 130
    assert error.startswith("robot3 carries the load of T1 (2 kg)")
    assert "Go on? [y/N]" in error
    assert terminal.link.cancelled == terminal.link.told == []


@pytest.mark.parametrize("words", [CANCEL, TAKE_OUT])
@pytest.mark.parametrize("given", [(), ("--yes",)], ids=["asked", "--yes"])
def test_a_person_who_says_yes_is_obeyed_and_with_the_option_not_asked(
    terminal, monkeypatch, words, given
):
    load_on_board(terminal)
    keyboard = Keyboard("y\n")
    monkeypatch.setattr("sys.stdin", keyboard)

    code, _, error = terminal(*words, *given)

    assert code == 0
    assert error.startswith("robot3 carries the load of T1 (2 kg)")
    assert ("Go on?" in error) is not bool(given)
    assert keyboard.read() == ("y\n" if given else "")
    assert len(terminal.link.cancelled) + len(terminal.link.told) == 1


def test_nobody_is_asked_where_a_request_has_no_consequences(terminal, monkeypatch):
    load_on_board(terminal)
    terminal.hive.records["T1"] = replace(LOADED, state=TaskState.WAITING, robot="", step=0)
    terminal.hive.start()
    monkeypatch.setattr("sys.stdin", Keyboard("n\n"))

    code, _, error = terminal(*CANCEL)

    assert (code, error) == (0, "task T1 is cancelled\n")


def test_taking_a_robot_out_says_first_what_becomes_of_its_tasks_and_its_load(terminal):
    terminal.hive.records["T1"] = LOADED
    waits = replace(LOADED, task=replace(LOADED.task, id="T2"), state=TaskState.ASSIGNED, step=0)
    terminal.hive.records["T2"] = waits
    terminal.hive.start()
    robot = RobotStatus("robot3", RobotState.BUSY, Pose(1, 2), 1.0)
    terminal.link.say(robot)
    terminal.link.on_set_state = lambda _robot, _word: terminal.link.say(
        replace(robot, state=RobotState.DEFECT, reason="defect, set by an operator")
    )

    code, _, error = terminal("robot", "robot3", "out")

    assert code == 0
    moved, load, done = error.splitlines()
    assert moved == "robot3 hands back T2; other robots get what they can do"
    assert load.startswith("robot3 carries the load of T1")
    assert done == "robot3 is defect: defect, set by an operator"
    assert terminal.link.told == [("robot3", "defect")]


def test_a_robot_is_sent_to_put_its_load_down_at_a_place(terminal):
    terminal.hive.start()
    terminal.link.known_places = {"test cell": Pose(17.8, 1.6, -1.5708)}
    robot = RobotStatus("robot3", RobotState.DEFECT, Pose(1, 2), 0.4, 2.0, reason="a load")
    terminal.link.say(robot)
    terminal.link.on_set_state = lambda _robot, _word: terminal.link.say(
        replace(robot, reason="brings the load of T1 to (17.80, 1.60)")
    )

    code, _, error = terminal("robot", "robot3", "put-down", "test cell")

    assert (code, error) == (0, "robot3 is defect: brings the load of T1 to (17.80, 1.60)\n")
    assert terminal.link.told == [("robot3", "put_down 17.800 1.600 -1.5708")]


@pytest.mark.parametrize("words", [("put-down",), ("out", "3,4"), ("in", "dock")])
def test_a_place_belongs_to_putting_down(terminal, words):
    code, _, error = terminal("robot", "robot3", *words)

    assert code == 2
    assert "a PLACE belongs to put-down" in error


@pytest.mark.parametrize(("word", "told"), [("in", "idle"), ("charge", "charge")])
def test_a_robot_is_put_back_in_service_or_sent_to_charge(terminal, word, told):
    terminal.hive.start()
    robot = RobotStatus("robot3", RobotState.DEFECT, Pose(1, 2), 0.4)
    after = RobotState.IDLE if word == "in" else RobotState.CHARGING
    terminal.link.say(robot)
    terminal.link.on_set_state = lambda _robot, _word: terminal.link.say(
        replace(robot, state=after)
    )

    code, _, error = terminal("robot", "robot3", word)

    assert (code, error) == (0, f"robot3 is {after.name.lower()}\n")
    assert terminal.link.told == [("robot3", told)]
