# SPDX-License-Identifier: BSD-3-Clause
"""What the files of the repository promise to users, wherever in `src/*/` they lie.

A file that changes its package is the same to the list, except where the package is part of the
name by which users call it: that of a message, and that of most launch files.
"""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[4]
INTERNAL = {"navigation.launch", "amcl.launch"}
"""Launch files that other launch files call; their package may change."""
CHOICES = {
    "models": "src/*/models/*.yaml",
    "worlds": "src/*/worlds/*.yaml",
    "fleets": "src/*/fleets/*.yaml",
    "scenarios": "src/*/scenarios/*.yaml",
    "maps": "maps/*.yaml",
}
"""Files that users choose by name."""
FIND = re.compile(r"\$\(find [\w-]+\)")


def message_definitions():
    """Return the lines of every message, service and action, without comments."""
    return {f"{path.parts[-3]}/{path.stem}": lines_of(path) for path in _types()}


def _types():
    return [
        path
        for kind in ("msg", "srv", "action")
        for path in sorted(ROOT.glob(f"src/*/{kind}/*.{kind}"))
    ]


def lines_of(path):
    """Return what a definition says: its fields, constants and separators, in their order."""
    lines = (line.partition("#")[0] for line in path.read_text(encoding="utf-8").splitlines())
    return [" ".join(line.split()) for line in lines if line.strip()]


def launch_arguments():
    """Return the arguments of every launch file with their defaults."""
    return _by_unique_name(
        (f"{'*' if path.name in INTERNAL else path.parts[-3]}/{path.name}", _arguments(path))
        for path in sorted(ROOT.glob("src/*/launch/*.launch"))
    )


def _arguments(path):
    """Return the arguments that users may give, and their defaults, whatever package has files."""
    arguments = ET.parse(path).getroot().findall("arg")  # noqa: S314  (our own file)
    return {
        each.get("name"): FIND.sub("$(find *)", each.get("default", "required"))
        for each in arguments
        if each.get("value") is None
    }


def executables():
    """Return the names of all executables."""
    return sorted(_by_unique_name((path.name, path) for path in _executable_files()))


def package_of(executable):
    """Return the package that has an executable, for rosrun."""
    return _by_unique_name((p.name, p.parts[-3]) for p in _executable_files())[executable]


def _executable_files():
    return [path for path in ROOT.glob("src/*/nodes/*") if path.is_file()]


def parameter_files():
    """Return every parameter file of a node: its parameters and their defaults."""
    return _by_unique_name(
        (path.name, yaml.safe_load(path.read_text(encoding="utf-8")))
        for path in sorted(ROOT.glob("src/*/config/*.yaml"))
    )


def choices():
    """Return the names that users may give for a model, a world, a fleet, a scenario or a map."""
    return {
        kind: sorted(_by_unique_name((path.stem, path) for path in ROOT.glob(pattern)))
        for kind, pattern in CHOICES.items()
    }


def _by_unique_name(pairs):
    """Return a mapping, once it is sure that no name is there twice."""
    found = {}
    for name, value in pairs:
        assert name not in found, f"{name} is in two packages, so nobody can tell which is meant"
        found[name] = value
    return found
