# SPDX-License-Identifier: BSD-3-Clause
"""Refuses arguments that a launch file does not have, which roslaunch ignores on its command line.

It also refuses a robot that runs already. Some of its nodes would take the place of those that
run, others would stay beside them, and two would drive one robot.

A launch file runs this for a parameter, so roslaunch is the parent process and ends with the error
before anything starts. Where a launch file is included, roslaunch checks its arguments by itself.
"""

from __future__ import annotations

import os
import socket
import sys
import xml.etree.ElementTree as ET
import xmlrpc.client
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fleet_manager.ros.launch_checked import DEFAULT_URI

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

_BAD_INPUT = 2
_CALLER = "/launch_arguments"
_ROBOT = "--robot="
_PATIENCE = 2.0  # for an answer of the master or a node [s]


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


def clash(robot: str) -> str:
    """Return which node speaks for a robot of this name already, in one line; empty if none does.

    A node that the master knows and that does not answer has ended, and does not count.
    """
    space = os.environ.get("ROS_NAMESPACE", "").strip("/")
    topic = "/".join(["", *filter(None, [space, robot, "set_state"])])
    socket.setdefaulttimeout(_PATIENCE)
    try:
        with xmlrpc.client.ServerProxy(os.environ.get("ROS_MASTER_URI", DEFAULT_URI)) as master:
            state: Any = master.getSystemState(_CALLER)
            nodes = [name for heard, names in state[2][1] if heard == topic for name in names]
            found: list[Any] = [(name, master.lookupNode(_CALLER, name)) for name in nodes]
    except (OSError, xmlrpc.client.Error):
        return ""
    for name, (_, _, uri) in found:
        if _answers(uri):
            return (
                f"{robot} runs already: the node {name} speaks for it; end its nodes first, or "
                "choose another name"
            )
    return ""


def _answers(uri: str) -> bool:
    try:
        with xmlrpc.client.ServerProxy(uri) as node:
            node.getPid(_CALLER)
    except (OSError, xmlrpc.client.Error):
        return False
    return True


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
    """Check the launch file that is the first argument; return the exit code.

    Before it may stand `--robot=NAME`, the robot that the file is going to start.
    """
    words = sys.argv[1:]
    robots = [words.pop(0).removeprefix(_ROBOT)] if words[0].startswith(_ROBOT) else []
    file, *choices = words
    problem = complaint(Path(file), parents_command(), choices)
    if not problem and (clashes := list(filter(None, map(clash, robots)))):
        problem = f"{Path(file).name}: {clashes[0]}"
    if problem:
        sys.stderr.write(f"launch_arguments: {problem}\n")
        return _BAD_INPUT
    sys.stdout.write("known")
    return 0
