# SPDX-License-Identifier: BSD-3-Clause
"""Refuses arguments that a launch file does not have, which roslaunch ignores on its command line.

A launch file runs this for a parameter, so roslaunch is the parent process and ends with the error
before anything starts. Where a launch file is included, roslaunch checks its arguments by itself.
"""

from __future__ import annotations

import os
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

_BAD_INPUT = 2


def complaint(file: Path, command: Sequence[str], choices: Iterable[str] = ()) -> str:
    """Return what is wrong with the arguments of a launch file, in one line; empty if nothing is.

    Args:
        file: The launch file.
        command: The words of the process that loads it.
        choices: For each argument with a few allowed values `NAME:ALLOWED|ALLOWED:VALUE`.
    """
    for choice in choices:
        name, allowed, value = choice.split(":", 2)
        if value not in allowed.split("|"):
            return f"{file.name}: {name}: '{value}'; allowed: {allowed.replace('|', ' | ')}"
    if not any(Path(word).name == file.name for word in command[1:]):
        return ""  # another file includes this one
    known = {tag.get("name", "") for tag in _arguments(file)}
    given = [word.partition(":=")[0] for word in command if ":=" in word]
    unknown = [name for name in given if name not in known and not name.startswith("_")]
    if not unknown:
        return ""
    allowed = ", ".join(sorted(known))
    return f"{file.name}: argument '{unknown[0]}' is unknown; allowed: {allowed}"


def _arguments(file: Path) -> list[ET.Element]:
    """Return the arguments of a launch file that a user may set."""
    root = ET.parse(file).getroot()  # noqa: S314  (our own launch file)
    return [tag for tag in root.findall("arg") if tag.get("value") is None]


def parents_command() -> list[str]:
    """Return the words of the process that started this one; none where they cannot be read."""
    try:
        words = Path(f"/proc/{os.getppid()}/cmdline").read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return []
    return words.split("\0")


def main() -> int:
    """Check the launch file that is the first argument; return the exit code."""
    file, *choices = sys.argv[1:]
    problem = complaint(Path(file), parents_command(), choices)
    if problem:
        sys.stderr.write(f"launch_arguments: {problem}\n")
        return _BAD_INPUT
    sys.stdout.write("known")
    return 0
