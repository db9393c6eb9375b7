# SPDX-License-Identifier: BSD-3-Clause
"""`hive learned`, with robots behind it that tell what they have learned, or something odd."""

import contextlib
import json
from dataclasses import replace

import pytest

from blackboard.consensus.messages import Heartbeat
from blackboard.costing.experience import Learned, by_formula
from blackboard.costing.saved_experience import SavedExperience, as_plain, saved_from
from blackboard.costing.track_record import Outcome
from blackboard.domain.characteristics import RobotState, RobotStatus
from fleet_manager.cli.context import CliContext
from fleet_manager.cli.main import run
from fleet_manager.client.client import ANSWER_WITHIN, REPEAT_EVERY
from fleet_manager.errors import NoHiveError
from fleet_manager.testing import FakeLink, Keyboard
from hive_common.pose import Pose

PACE = Learned(
    per_drive=2.5,
    per_metre=1.5,
    per_radian=0.75,
    friction=0.9,
    power=1.1,
    pick=1.25,
    place=1.0,
    time_margin=0.5,
    energy_margin=0.08,
    drives=34.0,
)
FIRST, LAST = (f"after {drives} drives: its tasks take {drives}% more time" for drives in (9, 30))
NOTHING = SavedExperience(learned=tuple(by_formula(1.0)))
ROBOTS = [
    RobotStatus(name, RobotState.IDLE, Pose(1.0, 2.0), 1.0)
    for name in ("robot1", "robot2", "robot10")
]


def outcome(off_by=0.05, late=False):
    """Return a task of 100 s and 1000 J: the formula said 30 % less time and half the energy."""
    most = 90.0 if late else 110.0
    said = 1.0 + off_by
    return Outcome(5.0, 70.0, 100.0 * said, most, 100.0, 500.0, 1000.0 * said, 1100.0, 1000.0)


def learned(tasks=(), changes=(), pace=PACE):
    """Return what a robot keeps that has done some tasks."""
    return SavedExperience(
        learned=tuple(pace), outcomes=tuple(map(tuple, tasks)), clipped=3, changes=changes
    )


class Terminal:
    """The command line, and robots that tell what they have learned and forget it when told."""

    def __init__(self, capsys):
        self.link = FakeLink()
        self.link.on_set_state = lambda robot, _word: self.keep(robot, NOTHING)
        self.robots = list(ROBOTS)
        self._capsys = capsys
        tasks = [outcome(0.2, late=True)] * 20 + [outcome(0.02)] * 20 + [outcome(-0.04)] * 7
        self.keep("robot1", learned(tasks, changes=(FIRST, LAST)))
        self.keep("robot2", NOTHING)

    def keep(self, robot, saved):
        self.link.learned[robot] = as_plain(saved)

    def __call__(self, *words):
        """Run `hive learned` with words; return exit code, stdout, stderr."""
        self.link.reconnect()
        self.link.robots = {robot.robot_id for robot in self.robots}
        self.link.say(Heartbeat(1, "/blackboard", heard=dict.fromkeys(self.link.robots, 0.0)))
        for robot in self.robots:
            self.link.say(robot)
        context = CliContext(lambda _record: contextlib.nullcontext(self.link))
        code = run(context, ["learned", *words])
        out, err = self._capsys.readouterr()
        return code, out, err


@pytest.fixture
def terminal(capsys):
    return Terminal(capsys)


def cells(line):
    """Return the cells of a line of a table."""
    return [cell.strip() for cell in line.split("  ") if cell.strip()]


def section(out, first):
    """Return the lines of a section that begins with a text, without that line."""
    lines = out.splitlines()
    start = next(number for number, line in enumerate(lines) if line.startswith(first))
    end = lines.index("", start) if "" in lines[start:] else len(lines)
    return [cells(line) for line in lines[start + 1 : end]]


def test_each_robot_has_a_line_with_its_errors_its_margins_and_the_last_change(terminal):
    code, out, err = terminal()

    head, one, two, ten = out.splitlines()
    assert (code, err) == (0, "")
    assert cells(head) == [
        *("ROBOT", "DRIVES", "TASKS", "TIME OFF BY", "ENERGY OFF BY"),
        *("TIME MARGIN", "ENERGY MARGIN", "CLIPPED", "REMARK"),
    ]
    assert cells(one) == [
        *("robot1", "34", "47", "30 % → 4.0 %", "50 % → 4.0 %"),
        *("3.9 s of 60 s", "8.0 %", "3", LAST),
    ]
    assert cells(two) == [
        *("robot2", "0", "0", "–", "–", "23 s of 60 s", "60 %", "0", "bids by the formula")
    ]
    assert cells(ten)[:2] == ["robot10", "–"]
    assert ten.endswith("it has no parameter `learned`, as robots of other makes have none")


def test_a_robot_that_has_tasks_and_no_drives_bids_by_the_formula(terminal):
    terminal.keep("robot2", learned([outcome()], (LAST,), PACE._replace(drives=0.0)))
    _, out, _ = terminal()

    assert cells(out.splitlines()[2])[2:5] == ["1", "30 % → 5.0 %", "50 % → 5.0 %"]
    assert out.splitlines()[2].endswith(f"bids by the formula; {LAST}")


def test_of_one_robot_the_error_over_time_is_shown_the_oldest_tasks_first(terminal):
    code, out, _ = terminal("robot1")

    assert code == 0
    assert out.splitlines()[:3] == [
        "robot1 bids by what it has learned from 34 drives",
        "nine of ten tasks that are predicted to take 60 s take at most 3.9 s longer",
        "nine of ten tasks draw at most 8.0 % more energy than predicted",
    ]
    assert section(out, "TASKS") == [
        ["1–20", *["30 % → 20 %"] * 2, *["50 % → 20 %"] * 2, "0 %", "100 %"],
        ["21–40", *["30 % → 2.0 %"] * 2, *["50 % → 2.0 %"] * 2, "100 %", "100 %"],
        ["41–47", *["30 % → 4.0 %"] * 2, *["50 % → 4.0 %"] * 2, "100 %", "100 %"],
    ]


def test_nineteen_of_twenty_tasks_are_off_by_no_more_than_is_said(terminal):
    errors = [outcome(each / 100.0) for each in range(1, 21)]
    terminal.keep("robot1", learned(errors[:1] + errors))
    _, out, _ = terminal("robot1")

    first, last = section(out, "TASKS")
    assert first[1:3] == ["30 % → 9.5 %", "30 % → 18 %"]
    assert last[1:3] == ["30 % → 20 %", "30 % → 20 %"]


def test_of_one_robot_it_is_shown_what_a_drive_takes_and_how_far_off_the_formula_is(terminal):
    _, out, _ = terminal("robot1")

    assert section(out, "A DRIVE TAKES") == [
        ["in any case", "2.50 s", "2.5 s, 13 %"],
        ["for its length", "1.50 s/m", "15 s, 76 %"],
        ["for turning", "0.75 s/rad", "2.4 s, 12 %"],
    ]
    assert section(out, "LEARNED SHARE") == [
        ["energy of friction", "90 %"],
        ["energy of electronics and arm", "110 %"],
        ["time of the arm for a pick", "125 %"],
        ["time of the arm for a place", "100 %"],
    ]
    assert out.endswith(
        f"predictions that were clipped: 3\nchanges noticed:\n  {FIRST}\n  {LAST}\n"
    )


def test_of_a_robot_that_has_learned_nothing_it_is_said_that_it_bids_by_the_formula(terminal):
    code, out, _ = terminal("robot2")

    assert code == 0
    assert out.startswith("robot2 bids by the formula\n")
    assert "it has finished no task since it began to learn" in out
    assert out.endswith("predictions that were clipped: 0\nno change was noticed\n")


def test_what_robots_keep_is_printed_for_programs(terminal):
    code, out, err = terminal("--json")
    told = json.loads(out)
    _, one, _ = terminal("robot1", "--json")

    assert code == 0
    assert err == f"{UNKNOWN}\n"
    assert list(told) == ["robot1", "robot2", "robot10"]
    assert saved_from(told["robot1"]).tasks[0] == outcome(0.2, late=True)
    assert told["robot10"] is None
    assert json.loads(one) == {"robot1": told["robot1"]}


UNKNOWN = (
    "nothing is known of what robot10 has learned: it has no parameter `learned`, as robots of "
    "other makes have none"
)
ODD = {
    "a number": (5, "5; allowed: the keys learned,"),
    "no numbers": ({}, "learned: missing; allowed: 10 numbers"),
    "too few": ({"learned": [1.0, 2.0]}, "learned: has 2 numbers; allowed: 10"),
    "a text": ({"learned": [*PACE[:9], "x"]}, "learned[9]: 'x'; allowed: a number"),
    "infinite": ({"learned": [*PACE[:9], float("inf")]}, "learned[9]: inf; allowed:"),
    "odd tasks": (
        {"learned": [*PACE], "outcomes": [[1.0]]},
        "outcomes[0]: has 1 numbers; allowed: 9",
    ),
    "lines": ({"learned": [*PACE], "of\nline\r\x0bbreaks": 1}, "of line breaks: unknown"),
}


@pytest.mark.parametrize(("content", "said"), ODD.values(), ids=ODD)
def test_an_odd_parameter_is_said_in_one_line_and_the_other_robots_are_shown(
    terminal, content, said
):
    terminal.link.learned["robot1"] = content
    code, out, err = terminal("robot1")

    assert (code, out) == (1, "")
    assert err.startswith("hive: robot1's parameter `learned` cannot be used: ")
    assert said in err
    assert len(err.splitlines()) == 1

    code, out, _ = terminal()
    _, one, two, _ = out.splitlines()
    assert code == 0
    assert said in one
    assert two.endswith("bids by the formula")


def test_numbers_that_tell_nothing_are_left_out(terminal):
    odd = PACE._replace(per_drive=-5.0, per_metre=0.5, per_radian=0.0, time_margin=1e10, drives=1)
    least = Outcome(0.0, 1e10, 1e-300, 1.0, 1e-300, 1.0, 1e10, 1.0, 1.0)
    terminal.keep("robot1", learned([least, outcome()._replace(time=-1.0)], pace=odd))
    code, out, _ = terminal("robot1")

    assert code == 0
    assert out.startswith("robot1 bids by what it has learned from 1 drive\n")
    assert "take at most – s longer" in out
    assert section(out, "TASKS")[0][:2] == ["1–1", "– → 0.0 %"]
    assert section(out, "A DRIVE TAKES")[1][2] == "5.0 s, –"
    assert cells(terminal()[1].splitlines()[1])[2:4] == ["1", "– → 0.0 %"]


def test_a_number_of_drives_below_0_counts_as_none(terminal):
    terminal.keep("robot1", learned(pace=PACE._replace(drives=-1.0)))

    assert terminal("robot1")[1].startswith("robot1 bids by the formula\n")
    assert terminal()[1].splitlines()[1].endswith("bids by the formula")


def test_texts_of_robots_are_shown_without_line_breaks_and_control_characters(terminal):
    terminal.keep("robot1", learned(changes=("once\nupon\x1b[31m a\ttime",)))
    _, out, _ = terminal("robot1")
    _, table, _ = terminal()

    assert out.endswith("changes noticed:\n  once upon [31m a time\n")
    assert table.splitlines()[1].endswith("once upon [31m a time")


def test_a_robot_that_is_not_there_is_named_with_those_that_are(terminal):
    for words in (("robot7",), ("robot7", "--forget", "--yes")):
        assert terminal(*words) == (
            *(1, ""),
            "hive: no robot robot7; there are: robot1, robot2, robot10\n",
        )
    assert terminal.link.told == []


def test_what_an_offline_robot_has_learned_is_shown_and_it_cannot_forget(terminal):
    gone = {"state": RobotState.OFFLINE, "reason": "not heard for 9 s"}
    terminal.robots[0] = replace(ROBOTS[0], **gone)

    assert terminal("robot1")[0] == 0
    code, _, err = terminal("robot1", "--forget", "--yes")
    assert (code, err) == (1, "hive: robot1 is offline: not heard for 9 s\n")


def test_where_no_robot_is_heard_that_is_said(terminal):
    terminal.robots = []

    assert terminal() == (0, "", "no robots; a blackboard is there\n")


LOST = "robot1 forgets what it has learned from 34 drives, and how its last 47 tasks went\n"
FORGOTTEN = "robot1 has forgotten what it had learned and bids by the formula\n"


def test_a_robot_forgets_and_that_is_waited_for(terminal):
    answer = terminal.link.on_set_state

    def deaf_at_first(robot, word):
        if len(terminal.link.told) > 2:
            answer(robot, word)

    terminal.link.on_set_state = deaf_at_first

    assert terminal("robot1", "--forget", "--yes") == (0, "", LOST + FORGOTTEN)
    assert terminal.link.told == [("robot1", "forget")] * 3


def test_a_robot_that_has_learned_anew_at_once_has_forgotten_too(terminal):
    anew = learned([outcome()], pace=PACE._replace(drives=2.0))
    terminal.link.on_set_state = lambda robot, _word: terminal.keep(robot, anew)

    assert terminal("robot1", "--forget")[0] == 0


@pytest.mark.parametrize("content", [5, None], ids=["odd", "missing"])
def test_a_robot_whose_parameter_cannot_be_used_forgets_and_writes_it_anew(terminal, content):
    terminal.link.learned["robot1"] = content
    code, _, err = terminal("robot1", "--forget")

    asked, done = err.splitlines(keepends=True)
    assert (code, done) == (0, FORGOTTEN)
    assert asked.endswith("; it forgets whatever it has learned\n")


def test_a_robot_that_has_nothing_to_forget_is_told_without_a_question(terminal, monkeypatch):
    monkeypatch.setattr("sys.stdin", Keyboard("n\n"))
    told_at = []
    terminal.link.on_set_state = lambda _robot, _word: told_at.append(terminal.link.now())

    assert terminal("robot2", "--forget") == (0, "", FORGOTTEN.replace("robot1", "robot2"))
    first, second = told_at  # ROS may lose the first
    assert second - first >= REPEAT_EVERY


@pytest.mark.parametrize(
    ("answer", "given", "code"), [("n\n", (), 130), ("y\n", (), 0), ("n\n", ("--yes",), 0)]
)
def test_a_person_is_asked_before_a_robot_forgets(terminal, monkeypatch, answer, given, code):
    monkeypatch.setattr("sys.stdin", Keyboard(answer))
    found, _, err = terminal("robot1", "--forget", *given)

    assert found == code
    assert err.startswith(LOST)
    assert ("Go on?" in err) is not bool(given)
    assert bool(terminal.link.told) is (code == 0)


def test_a_robot_that_does_not_forget_is_told_again_and_then_it_is_said_what_to_do(terminal):
    terminal.link.on_set_state = lambda _robot, _word: None
    before = terminal.link.now()
    code, _, err = terminal("robot1", "--forget", "--yes")

    assert code == 1
    assert "hive: robot1 has not told within 6 s that it has forgotten; its log says why" in err
    assert terminal.link.now() - before >= ANSWER_WITHIN
    assert len(terminal.link.told) > 5


def test_a_master_that_ends_meanwhile_is_said(terminal, monkeypatch):
    def gone(_robot):
        raise NoHiveError("the ROS master does not tell")

    monkeypatch.setattr(terminal.link, "learned_of", gone)

    for words in ((), ("robot1",), ("robot1", "--forget")):
        assert terminal(*words) == (3, "", "hive: the ROS master does not tell\n")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--forget",), "--forget is for one ROBOT"),
        (("robot1", "--forget", "--json"), "without --json"),
        (("robot1", "--yes"), "--yes belongs to --forget"),
        (("robot1", "robot2"), "unexpected extra argument"),
    ],
)
def test_words_that_do_not_go_together_are_refused(terminal, words, said):
    code, out, err = terminal(*words)

    assert (code, out) == (2, "")
    assert said in err
    assert terminal.link.told == []
