# SPDX-License-Identifier: BSD-3-Clause
"""`hive traffic` and `hive zone`, with a fake traffic planner behind them."""

import contextlib
import json

import pytest

from fleet_manager.cli.context import CliContext
from fleet_manager.cli.main import run
from fleet_manager.client.traffic import Lock, RobotWait, SlowPlace, TrafficState, ZoneCommand
from fleet_manager.testing import FakeLink

BUSY = TrafficState(
    epoch=4001,
    time=100.0,
    robots=("robot1", "robot2", "robot3"),
    zones=("door", "hall"),
    closed=("hall",),
    waits=(
        RobotWait("robot3", "robot1", 4.0, 2.5, 92.0, "at the dock"),
        RobotWait("robot2", "robot3", 5.0, 2.5, 30.0, "at (5.0, 2.5)"),
    ),
    slowest=(SlowPlace(4.2, 2.6, 95.0, 7, "near the dock", 4.5),),
    locks=(Lock("held", ("robot2",), 60.0, "robot2 stands at the dock"),),
    counts={"circle": 2, "blocked": 0, "held": 1},
    unreached={"robot1": ("shelf", "dock")},
)
QUIET = TrafficState(epoch=4001, time=100.0, robots=("robot1",))


class Terminal:
    """The command line, and a planner that answers when it is not deaf."""

    def __init__(self, capsys):
        self.link = FakeLink()
        self.link.on_switch = self._switch
        self.closed = {"hall"}
        self.deaf = 0
        self._capsys = capsys

    def say(self, state):
        self.link.say(state)

    def _switch(self, command):
        if self.deaf:
            self.deaf -= 1
            return
        change = self.closed.add if command.closed else self.closed.discard
        change(command.zone)
        zones = BUSY.zones
        self.say(TrafficState(4001, 101.0, zones=zones, closed=tuple(sorted(self.closed))))

    def __call__(self, *words):
        """Run `hive` with words; return exit code, stdout, stderr."""
        code = run(CliContext(lambda _record: contextlib.nullcontext(self.link)), list(words))
        out, err = self._capsys.readouterr()
        return code, out, err


@pytest.fixture
def terminal(capsys):
    return Terminal(capsys)


def test_traffic_shows_who_waits_for_whom_where_and_how_long_the_longest_first(terminal):
    terminal.say(BUSY)
    code, out, _ = terminal("traffic")
    lines = out.splitlines()

    assert code == 0
    assert lines[0].split() == ["ROBOT", "WAITS", "FOR", "PLACE", "FOR"]
    assert lines[1].split() == ["robot2", "robot3", "at", "(5.0,", "2.5)", "1", "min", "10", "s"]
    assert lines[2].split() == ["robot3", "robot1", "at", "the", "dock", "8", "s"]


def test_traffic_shows_closed_zones_and_slow_places(terminal):
    terminal.say(BUSY)
    _, out, _ = terminal("traffic")

    assert "closed zones: hall\n" in out
    assert "4.2, 2.6    near the dock  1 min 35 s  7\n" in out


def test_traffic_shows_who_cannot_go_on_what_is_out_of_reach_and_how_often(terminal):
    terminal.say(BUSY)
    _, out, _ = terminal("traffic")

    assert out.splitlines()[-3:] == [
        "cannot go on for 40 s: robot2 stands at the dock",
        "robot1 cannot reach shelf, dock",
        "locks so far: circle 2, held 1",
    ]


def test_traffic_that_flows_is_said_in_one_line(terminal):
    terminal.say(QUIET)
    _, out, _ = terminal("traffic")

    assert out == "no robot waits for another one\n"


def test_traffic_as_json_has_numbers_in_metres_and_seconds(terminal):
    terminal.say(BUSY)
    code, out, _ = terminal("traffic", "--json")
    data = json.loads(out)

    assert code == 0
    assert data["waits"][0] == {
        "robot": "robot3",
        "waits_for": "robot1",
        "x": 4.0,
        "y": 2.5,
        "where": "at the dock",
        "for": 8.0,
    }
    assert data["zones"] == [{"name": "door", "closed": False}, {"name": "hall", "closed": True}]
    assert data["slowest"] == [
        {"x": 4.2, "y": 2.6, "where": "near the dock", "waited": 95.0, "waits": 7, "delay": 4.5}
    ]
    assert data["locks"] == [
        {"kind": "held", "robots": ["robot2"], "for": 40.0, "text": "robot2 stands at the dock"}
    ]
    assert data["locks_so_far"] == {"circle": 2, "blocked": 0, "held": 1}
    assert data["unreached"] == {"robot1": ["shelf", "dock"]}
    assert data["robots"] == list(BUSY.robots)


LOADING = TrafficState(
    epoch=4001, time=100.0, zones=("door",), status="it has been loading for 9 s, and starts"
)


def test_traffic_says_how_far_a_planner_is_that_is_being_loaded(terminal):
    terminal.say(LOADING)
    code, out, _ = terminal("traffic")

    assert code == 0
    assert out.splitlines()[:2] == [
        "the fleet's traffic is planned, but not now; robots drive by right of way",
        "the traffic planner: it has been loading for 9 s, and starts",
    ]
    assert "closed zones: none" in out


def test_the_json_of_traffic_has_why_none_is_planned(terminal):
    terminal.say(LOADING)
    _, out, _ = terminal("traffic", "--json")

    assert json.loads(out)["status"] == "it has been loading for 9 s, and starts"


@pytest.mark.parametrize("words", [["traffic"], ["zone", "close", "door"]])
def test_without_a_traffic_planner_the_remedy_is_named(terminal, words):
    code, out, err = terminal(*words)

    assert (code, out) == (3, "")
    assert "traffic: planned" in err


def test_a_zone_is_closed_when_the_planner_says_so(terminal):
    terminal.say(BUSY)
    code, _, err = terminal("zone", "close", "door")

    assert (code, err) == (0, "zone door is closed\n")
    assert terminal.link.switched == [ZoneCommand("door", closed=True)]
    assert terminal.closed == {"door", "hall"}


def test_a_zone_is_opened_again(terminal):
    terminal.say(BUSY)
    code, _, err = terminal("zone", "open", "hall")

    assert (code, err) == (0, "zone hall is open\n")
    assert terminal.closed == set()


def test_a_command_that_was_lost_is_repeated(terminal):
    terminal.deaf = 2
    terminal.say(BUSY)
    code, _, _ = terminal("zone", "close", "door")

    assert code == 0
    assert len(terminal.link.switched) == 3


def test_a_planner_that_does_not_answer_leaves_it_open_whether_the_zone_is_closed(terminal):
    terminal.deaf = 100
    terminal.say(BUSY)
    code, _, err = terminal("zone", "close", "door")

    assert code == 3
    assert "zone door may not be closed" in err


def test_a_zone_that_does_not_exist_is_refused_with_those_that_do(terminal):
    terminal.say(BUSY)
    code, _, err = terminal("zone", "close", "roof")

    assert code == 2
    assert err == "hive: there is no zone 'roof'; allowed: door, hall\n"
    assert terminal.link.switched == []


def test_where_the_fleet_file_names_no_zone_the_remedy_is_said(terminal):
    terminal.say(QUIET)
    code, _, err = terminal("zone", "close", "roof")

    assert code == 2
    assert "`zones` in the fleet file" in err
