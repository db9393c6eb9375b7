# SPDX-License-Identifier: BSD-3-Clause
"""The style tools find nothing to say. A tool that is not installed is skipped, with its name."""

import os
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = ["hive", ".ci/run", *sorted(str(p.relative_to(ROOT)) for p in ROOT.glob("setup/*bash*"))]

TOOLS = {
    "ruff check": ["ruff", "check", "."],
    "ruff format": ["ruff", "format", "--check", "."],
    "mypy": ["mypy"],
    "import-linter": ["lint-imports", "--no-cache"],
    "catkin_lint": [
        "catkin_lint",
        "--offline",
        "--strict",
        "-W2",
        "--config",
        ".catkin_lint",
        "src",
    ],
    "shellcheck": ["shellcheck", "-x", *SCRIPTS],
    "codespell": ["codespell"],
}


@pytest.mark.parametrize("name", TOOLS)
def test_a_style_tool_finds_nothing(name):
    program, *arguments = TOOLS[name]
    beside_python = shutil.which(program, path=str(Path(sys.executable).parent))
    path = beside_python or shutil.which(program)
    if path is None:
        pytest.skip(f"{program} is not installed; ./hive setup does so")
    if name == "mypy" and not version("numpy").startswith("1."):
        pytest.skip(f"types are checked with Debian 12's numpy 1; this is {version('numpy')}")
    # import-linter must find the sources, not catkin's relays to them.
    sources = os.pathsep.join(str(folder) for folder in ROOT.glob("src/*/src"))
    done = subprocess.run(
        [path, *arguments],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": sources},
        capture_output=True,
        text=True,
        check=False,
    )

    assert done.returncode == 0, f"{done.stdout}{done.stderr}"
