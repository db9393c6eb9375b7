# SPDX-License-Identifier: BSD-3-Clause
"""What the command line imports: every word of `hive` waits for it."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("blackboard.msg", reason="needs the generated messages")

HEAVY = {
    "PIL", "cattrs", "jsonschema", "matplotlib", "numba", "numpy", "ompl", "roslaunch", "scipy",
    "shapely",
}  # fmt: skip

PROGRAM = """
import os, sys
from fleet_manager.ros import command_line

leave = os._exit

def end(code):
    print(code, *sorted({name.partition(".")[0] for name in sys.modules}), flush=True)
    leave(0)

os._exit = end
command_line.main()
"""


def run(*words, folder):
    """Run a command where no ROS master answers; return its exit code and what it imported."""
    nowhere = {"ROS_MASTER_URI": "http://127.0.0.1:9", "ROS_HOME": str(folder)}
    ended = subprocess.run(
        [sys.executable, "-c", PROGRAM, *words],
        env=os.environ | nowhere,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    code, *modules = ended.stdout.split()
    return int(code), set(modules)


@pytest.mark.parametrize(
    "words", [["tasks"], ["robots"], ["add", "GA", "--goal", "1,2"], ["cancel", "T1"]]
)
def test_a_command_that_asks_the_hive_imports_nothing_heavy(words, tmp_path):
    code, modules = run(*words, folder=tmp_path)

    assert code == 3
    assert "rospy" in modules
    assert modules & HEAVY == set()


def test_a_hive_over_zenoh_is_asked_without_ros(tmp_path):
    fleet = tmp_path / "mine.yaml"
    fleet.write_text(
        'transport: zenoh\nzenoh: {routers: [{name: hall, address: "127.0.0.1:9"}]}\n'
        "robots: [{name: amy, model: mir100, pose: [1, 2, 0]}]\n"
    )

    code, modules = run("--connect", str(fleet), "tasks", folder=tmp_path)

    assert code == 3
    assert "zenoh" in modules
    assert modules & {"rospy", "rosgraph", "roslaunch", "numba", "ompl"} == set()


def test_what_roslaunch_adds_to_the_words_of_a_node_is_left_out(tmp_path):
    code, _ = run("tasks", "__name:=router_north", "__log:=/x.log", folder=tmp_path)

    assert code == 3  # the words can be used, and no master answers


def test_why_imports_nothing_heavy_and_no_rospy(tmp_path):
    code, modules = run("why", "T1", folder=tmp_path)

    assert code == 1
    assert modules & {*HEAVY, "rospy"} == set()
