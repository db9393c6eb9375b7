# SPDX-License-Identifier: BSD-3-Clause
"""A new user follows docs/your-site.md from an empty folder to tasks that are done."""

import subprocess

import rosgraph
from launching import wait_until_empty
from site_page import commands, save_files

from hive_lab.runner.limits import PATIENCE

DONE_BEFORE = [["./hive", "shell"], ["export", "ROS_MASTER_URI=..."]]
"""The shell of this test stands for those of the page."""
HEADLESS = ("rviz:=false", "gui:=false")
FAST = "rtf:=8"
"""Simulated time waits for the robots, so a machine that is slower is not wrong."""
REAL = ("/blackboard", "/robot1/robot", "/robot2/robot", "/robot1/amcl", "/robot2/amcl")
"""Nodes of the hive of real robots; simulated robots share the process of other nodes."""
ROBOTS = ("robot1", "robot2")


def nodes():
    """Return the nodes that the master knows."""
    state = rosgraph.Master("/operator").getSystemState()
    return {node for kind in state for _, names in kind for node in names}


class User:
    """Types the commands of the page one after the other."""

    def __init__(self, folder, launches):
        self._folder = folder
        self._launches = launches
        self._hive = None

    def types(self, words):
        """Run a command as its kind wants it; return what it has printed."""
        if words[0] == "roslaunch":
            self._start(words)
            return ""
        if words == ["hive", "robots"]:
            wait_until_empty(self._robots_that_are_not_idle)
        return self._run(words)

    def _start(self, words):
        """Start a hive in place of the one that runs."""
        if self._hive is not None:
            self._launches.stop(self._hive)
        simulated = "sim:=false" not in words
        self._hive = self._launches.run(
            *("env", f"--chdir={self._folder}", f"PWD={self._folder}"),
            *(*words, *HEADLESS, *([FAST] if simulated else [])),
        )
        expected = {"/blackboard", "/simulator"} if simulated else set(REAL)
        wait_until_empty(lambda: expected - nodes())
        assert simulated or "/simulator" not in nodes()

    def _robots_that_are_not_idle(self):
        shown = self._run(["hive", "robots"], codes=(0, 3)).splitlines()
        idle = [line for line in shown if "IDLE" in line]
        return [name for name in ROBOTS if not any(line.startswith(name) for line in idle)]

    def _run(self, words, codes=(0,)):
        done = subprocess.run(
            words, cwd=self._folder, capture_output=True, text=True, check=False, timeout=PATIENCE
        )
        assert done.returncode in codes, (words, done.stdout, done.stderr)
        return done.stdout


def test_every_command_of_the_page_does_what_the_page_says(launches, tmp_path):
    save_files(tmp_path)
    user = User(tmp_path, launches)

    printed = {" ".join(w): user.types(w) for w in commands() if w not in DONE_BEFORE}

    posted = [text for words, text in printed.items() if words.startswith("hive add")]
    assert posted == ["T1\n", "T2\n", "T3\n"]
    assert "does not do GPAB" in printed["hive why T3"]
