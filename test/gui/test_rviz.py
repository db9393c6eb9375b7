# SPDX-License-Identifier: BSD-3-Clause
"""A click in a real RViz window, made by xdotool, fills a goal."""

from __future__ import annotations

import os
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest
import yaml

from blackboard.domain.task import TaskType
from hive_common.resources import package_folder
from hive_lab.runner.limits import CASE

# rospy leaves sockets to be closed by the garbage collector.
pytestmark = [
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
    pytest.mark.timeout(CASE),  # the first test waits for the whole hive to come up
]

CONFIG = package_folder("simenv") / "rviz" / "hive.rviz"
HALF_A_CELL = 0.025
"""Of the lab's map [m]."""

TITLE = " - RViz$"
RANGE = 21
"""Bits of a window's number that its own connection to the screen gives out."""

AT_REST = 60
"""Looks in which RViz has kept its size, after which it is taken to be complete."""


def xdotool(*words):
    done = subprocess.run(["xdotool", *words], capture_output=True, text=True, check=False)
    return done.stdout


@dataclass(frozen=True)
class Canvas:
    """The part of RViz that shows the map, from above.

    Attributes:
        window: X's number of it.
        left: Of its corner on the screen [pixel].
        top: Of its corner on the screen [pixel].
        width: [pixel].
        height: [pixel].
    """

    window: int
    left: int
    top: int
    width: int
    height: int

    def map_position(self, column, row):
        """Return the place on the map [m] under the middle of a pixel of the screen."""
        view = yaml.safe_load(CONFIG.read_text())["Visualization Manager"]["Views"]["Current"]
        right = (column + 0.5 - self.left - self.width / 2) / view["Scale"]
        up = (self.top + self.height / 2 - row - 0.5) / view["Scale"]
        return view["X"] + right, view["Y"] + up


def windows_named(pattern):
    return {
        int(number) for number in xdotool("search", "--onlyvisible", "--name", pattern).split()
    }


def find_canvas(others):
    """Return RViz's canvas; None while there is none.

    The canvas belongs to OGRE, which speaks to the screen on a connection of its own: its number
    comes from another range than those of RViz's other windows.

    Args:
        others: Numbers of the windows that were there before RViz.
    """
    ranges = {number >> RANGE for number in windows_named(TITLE)}
    for number in windows_named("^$") - others if ranges else ():
        geometry = xdotool("getwindowgeometry", "--shell", str(number))
        numbers = re.findall(r"\b[XYWH]\w*=(-?\d+)", geometry)
        if number >> RANGE not in ranges and len(numbers) == 5:
            return Canvas(*map(int, numbers))
    return None


@pytest.fixture
def canvas(person, hive_window, tmp_path):  # noqa: ARG001  (RViz lies on top of it)
    others, seen = windows_named("^$"), []
    command, software = ["rviz", "-d", str(CONFIG)], {"LIBGL_ALWAYS_SOFTWARE": "1"}
    with Path(tmp_path / "rviz.log").open("wb") as log:
        rviz = subprocess.Popen(command, env=os.environ | software, stdout=log, stderr=log)

    def at_rest():
        """RViz opens small and grows when it has read its configuration."""
        seen.append(find_canvas(others))
        return seen[-1] and len(seen) > AT_REST and len(set(seen[-AT_REST:])) == 1

    try:
        person.wait_until(at_rest)
        yield seen[-1], lambda: find_canvas(others)
    finally:
        rviz.kill()
        rviz.wait()


def test_a_click_in_rviz_fills_the_goal_within_half_a_cell(person, hive_window, canvas):
    person.wait_until(lambda: hive_window.isActiveWindow() or hive_window.activateWindow())
    (canvas, look), entry = canvas, hive_window.entry
    goal = entry.goal_editors["A"]
    person.choose(entry.type_box, int(TaskType.GAB))
    person.click(goal.pick_button)
    column, row = canvas.left + canvas.width // 4, canvas.top + canvas.height * 5 // 8
    tries = []

    def filled():
        if len(tries) % 50 == 0:  # the map may not be drawn yet, and then a click hits nothing
            for rviz in windows_named(TITLE):
                xdotool("windowfocus", str(rviz), "mousemove", str(column), str(row))
                xdotool("key", "c", "sleep", "0.5", "click", "1")
        tries.append(None)
        return goal.x_edit.text()

    person.wait_until(filled)

    x, y = (look() or canvas).map_position(column, row)  # it may have grown meanwhile
    assert float(goal.x_edit.text()) == pytest.approx(x, abs=HALF_A_CELL)
    assert float(goal.y_edit.text()) == pytest.approx(y, abs=HALF_A_CELL)
    following = entry.goal_editors["B"]
    # An earlier click that RViz was slow to answer has filled B by now.
    assert following.pick_button.isChecked() or following.x_edit.text() == goal.x_edit.text()
