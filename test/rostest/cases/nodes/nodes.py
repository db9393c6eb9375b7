# SPDX-License-Identifier: BSD-3-Clause
"""Every node can be loaded where ROS, Qt and OMPL are; every launch file tells its arguments."""

import ast
import subprocess
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[4]
LAUNCH_FILES = sorted(ROOT.glob("src/*/launch/*.launch"))
NODES = sorted(path for path in ROOT.glob("src/*/nodes/*") if path.is_file())


@pytest.mark.parametrize("path", NODES, ids=lambda path: f"{path.parts[-3]}/{path.name}")
def test_what_a_node_runs_can_be_loaded(path):
    imports = [s for s in ast.parse(path.read_text()).body if isinstance(s, ast.ImportFrom)]
    loaded = [getattr(import_module(s.module), name.name) for s in imports for name in s.names]

    assert any(callable(thing) for thing in loaded)


@pytest.mark.parametrize("path", LAUNCH_FILES, ids=lambda path: f"{path.parts[-3]}/{path.name}")
def test_a_launch_file_tells_its_arguments(path):
    told = subprocess.run(
        ["roslaunch", "--ros-args", str(path)], capture_output=True, text=True, check=False
    )

    assert told.returncode == 0, told.stderr
    assert "Arguments:" in told.stdout
