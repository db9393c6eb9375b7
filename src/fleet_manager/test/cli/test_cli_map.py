# SPDX-License-Identifier: BSD-3-Clause
"""`hive map`, with a fake hive and map server behind it."""

import contextlib
import json
import sys
from dataclasses import replace

import numpy as np
import pytest

from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.domain.characteristics import RobotState, RobotStatus
from fleet_manager.cli.context import CliContext
from fleet_manager.cli.main import run
from fleet_manager.client.client import NEW_MAP_WITHIN
from fleet_manager.errors import NoHiveError
from fleet_manager.testing import FakeLink, Keyboard
from hive_common.grid_map import GridMap
from hive_common.map_file import load_map, save_map
from hive_common.map_id import NO_MAP, MapId, checksum_of
from hive_common.pose import Pose

HALL = MapId("hall", "0000aaaa")
BEAT = Heartbeat(
    1, "/blackboard", "", ("/blackboard",), heard={"robot1": 0.0, "robot2": 0.0}, map=HALL
)
ROBOTS = [
    RobotStatus(name, RobotState.IDLE, Pose(1.0, 1.0), 1.0, map=HALL)
    for name in ("robot1", "robot2")
]


class Terminal:
    """The command line, and a hive whose robots use what its map server serves."""

    def __init__(self, capsys):
        self.link = FakeLink()
        self.link.on_change_map = self._change_map
        self.link.known_places = {"dock": Pose(3.0, 3.0)}
        self.link.radii = {"robot1": 0.2, "robot2": 0.2}
        self.deaf = ()
        self._capsys = capsys
        self.tell(HALL)
        self.link.say(TaskList(1, 1, ()))

    def tell(self, used):
        for second in range(200):
            self.link.say(replace(BEAT, map=used), after=second)
            for robot in ROBOTS:
                own = HALL if robot.robot_id in self.deaf else used
                self.link.say(replace(robot, map=own), after=second + 0.5)

    def _change_map(self, path):
        self.link.reconnect()
        grid = load_map(str(path))
        self.tell(MapId(path.stem, checksum_of(grid)))

    def __call__(self, *words):
        """Run `hive` with words; return exit code, stdout, stderr."""
        code = run(CliContext(lambda _record: contextlib.nullcontext(self.link)), list(words))
        out, err = self._capsys.readouterr()
        return code, out, err


@pytest.fixture
def terminal(capsys):
    return Terminal(capsys)


def map_file(folder, name="new_hall", wall=False):
    """Write a map of a hall of 4 m x 4 m; return its file and what it is called."""
    blocked = np.zeros((80, 80), dtype=bool)
    blocked[:, 40] = wall
    grid = GridMap.of_blocked(blocked, 0.05)
    save_map(grid, folder / name)
    return folder / f"{name}.yaml", str(MapId(name, checksum_of(grid)))


def test_show_tells_who_uses_which_map(terminal):
    terminal.link.say(replace(ROBOTS[1], map=MapId("", "0000bbbb")), after=0.6)
    terminal.link.say(replace(ROBOTS[1], robot_id="robot3", map=NO_MAP), after=0.6)
    terminal.link.robots = {"robot1", "robot2", "robot3"}
    code, out, _ = terminal("map", "show")

    assert code == 0
    assert out.splitlines() == [
        "the leader, blackboard, uses map 'hall' (0000aaaa)",
        "ROBOT   MAP   CHECKSUM",
        "robot1  hall  0000aaaa",
        "robot2  –     0000bbbb  not the leader's: gets no tasks",
        "robot3  –     –",
    ]


def test_show_prints_json(terminal):
    code, out, _ = terminal("map", "show", "--json")

    hall = {"name": "hall", "checksum": "0000aaaa"}
    assert code == 0
    assert json.loads(out) == {"leader": hall, "robots": {"robot1": hall, "robot2": hall}}


def test_load_has_the_map_server_read_the_file_and_waits_for_every_robot(terminal, tmp_path):
    path, called = map_file(tmp_path)
    code, _, err = terminal("map", "load", str(path))

    assert (code, err) == (0, f"robot1, robot2: {called} is in use\n")
    assert terminal.link.maps == [path]


def test_load_takes_a_path_from_here(terminal, tmp_path, monkeypatch):
    path, _ = map_file(tmp_path)
    monkeypatch.chdir(tmp_path)

    assert terminal("map", "load", "./new_hall.yaml")[0] == 0
    assert terminal.link.maps == [path]


def test_what_a_map_puts_out_of_reach_is_said_first(terminal, tmp_path):
    path, _ = map_file(tmp_path, wall=True)
    code, _, err = terminal("map", "load", str(path), "--yes")

    assert code == 0
    assert err.splitlines()[0] == "robot1, robot2 cannot reach dock"


def test_a_person_may_say_no_to_what_a_map_brings_with_it(terminal, tmp_path, monkeypatch):
    path, _ = map_file(tmp_path, wall=True)
    monkeypatch.setattr(sys, "stdin", Keyboard("n\n"))
    code, _, err = terminal("map", "load", str(path))

    assert code == 130
    assert "cannot reach dock" in err
    assert terminal.link.maps == []


def test_a_robot_that_goes_on_with_its_old_map_is_named(terminal, tmp_path):
    path, called = map_file(tmp_path)
    terminal.deaf = ("robot2",)
    before = terminal.link.now()
    code, _, err = terminal("map", "load", str(path))

    assert code == 1
    assert f"not everybody uses {called} after 180 s: robot2 uses map 'hall' (0000aaaa);" in err
    assert terminal.link.now() - before >= NEW_MAP_WITHIN


def test_a_robot_that_falls_silent_is_not_waited_for(terminal, tmp_path):
    path, called = map_file(tmp_path)
    grid = load_map(str(path))

    def change_map(_path):
        terminal.link.reconnect()
        used = MapId("new_hall", checksum_of(grid))
        for second in range(30):
            terminal.link.say(replace(BEAT, map=used), after=second)
            terminal.link.say(replace(ROBOTS[0], map=used), after=second)

    terminal.link.on_change_map = change_map

    assert terminal("map", "load", str(path)) == (0, "", f"robot1: {called} is in use\n")


def test_a_file_that_is_no_map_is_refused_before_anything_is_asked(terminal, tmp_path):
    (tmp_path / "odd.yaml").write_text("image: nothing.pgm\n")
    code, _, err = terminal("map", "load", str(tmp_path / "odd.yaml"))

    assert code == 2
    assert "odd.yaml" in err
    assert err.count("\n") == 1
    assert terminal.link.maps == []


def test_where_no_map_server_answers_that_is_said(terminal, tmp_path):
    def silent(_path):
        raise NoHiveError("no map server")

    path, _ = map_file(tmp_path)
    terminal.link.on_change_map = silent

    assert terminal("map", "load", str(path)) == (3, "", "hive: no map server\n")
