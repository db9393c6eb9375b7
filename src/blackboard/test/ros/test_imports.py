# SPDX-License-Identifier: BSD-3-Clause
"""What a robot's process loads, because fifty of them run on one machine."""

import subprocess
import sys

import pytest

pytest.importorskip("blackboard.msg")


def test_a_robot_loads_scipy_only_for_a_map_and_never_numba():
    code = "import sys, blackboard.ros.robot_node; print({'scipy', 'numba'} & sys.modules.keys())"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert run.stdout == "set()\n"
