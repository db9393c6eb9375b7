# SPDX-License-Identifier: BSD-3-Clause
"""The cores run where there is no ROS, no Qt and no OMPL: each is loaded in such a place."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

tomllib = pytest.importorskip("tomllib")

ROOT = Path(__file__).resolve().parents[2]
WITH_OMPL = {
    "robot_navigation.planning.ompl_planner",
    "hive_lab.bench.plan",
    "hive_lab.fleets.traffic",
    "hive_lab.bench.localization",
    "hive_lab.fleets.recording",
    "hive_lab.bench.charge",
    "hive_lab.fleets.simulated_bodies",
}
"""The adapter, and the benchmarks and the simulated traffic that use what is behind it."""
SHELLS = {"ros", "gui", "live", "windows"}
"""The folders that may import ROS and Qt; the last two belong to hive_lab."""
WHEELS = ["ompl", "xacro"]
"""What ./hive setup installs. Modules that need one of these are left out where it is missing."""

# What ruff bans from the cores; our own packages are named there with a dot, and are files here.
BANNED = {
    name
    for name in tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["ruff"]["lint"][
        "flake8-tidy-imports"
    ]["banned-api"]
    if "." not in name
}

# Runs in the other interpreter: refuses what is banned, loads the modules, prints what went wrong.
LOADER = """
import importlib, json, sys

banned, wheels, modules = json.loads(sys.argv[1])

class Refuse:
    def find_spec(self, name, path=None, target=None):
        root = name.partition(".")[0]
        if root in banned or root.endswith("_msgs") or root.endswith("_srvs"):
            raise ImportError(f"{name} is not for a core")

sys.meta_path.insert(0, Refuse())
problems = {}
for module in modules:
    try:
        importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name not in wheels:
            problems[module] = str(error)
    except Exception as error:
        problems[module] = f"{type(error).__name__}: {error}"
print(json.dumps([problems, sorted({name.partition(".")[0] for name in sys.modules})]))
"""


def core_modules():
    """Return the dotted names of all modules outside the folders that may import ROS and Qt."""
    modules = []
    for package in ROOT.glob("src/*/src"):
        for path in package.rglob("*.py"):
            parts = path.relative_to(package).with_suffix("").parts
            if not SHELLS & set(parts):
                modules.append(".".join(part for part in parts if part != "__init__"))
    return sorted(modules)


def load(modules, banned):
    """Load modules in a fresh interpreter; return the problems and all roots it has loaded."""
    sources = os.pathsep.join(str(path) for path in ROOT.glob("src/*/src"))
    done = subprocess.run(
        [sys.executable, "-c", LOADER, json.dumps([sorted(banned), WHEELS, modules])],
        env=os.environ | {"PYTHONPATH": sources},
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(done.stdout.splitlines()[-1])


def test_every_core_module_loads_without_ros_qt_and_ompl():
    problems, loaded = load(sorted(set(core_modules()) - WITH_OMPL), BANNED)

    assert problems == {}
    assert not BANNED & set(loaded)


def test_what_needs_ompl_loads_without_ros_and_qt():
    problems, loaded = load(sorted(WITH_OMPL), BANNED - {"ompl"})

    assert problems == {}
    assert not (BANNED - {"ompl"}) & set(loaded)


def test_the_loader_refuses_what_is_banned():
    problems, _ = load(["rospy", "geometry_msgs.msg", "PyQt5.QtCore", "ompl"], BANNED)

    assert set(problems) == {"rospy", "geometry_msgs.msg", "PyQt5.QtCore", "ompl"}
    assert all("is not for a core" in problem for problem in problems.values())
