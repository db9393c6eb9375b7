# SPDX-License-Identifier: BSD-3-Clause
"""Starts a fleet whose file was checked, from the launch text that the check has printed.

`fleet_manager.launch` has the fleet file checked by `launch_fleet --print` before anything starts,
and keeps what the check prints in a parameter. Starting from it takes a tenth of the imports that
a second check would.
"""

from __future__ import annotations

import os
import sys
import xmlrpc.client
from typing import Any, NoReturn

DEFAULT_URI = "http://localhost:11311"
"""Address of the ROS master where ROS_MASTER_URI names none."""
_FOUND = 1


def become_roslaunch(text: str) -> NoReturn:
    """Replace this process by a roslaunch that reads a text, so that signals reach it directly."""
    file = os.memfd_create("fleet.launch")
    os.write(file, text.encode())
    os.lseek(file, 0, os.SEEK_SET)
    os.dup2(file, sys.stdin.fileno())
    os.execvp("roslaunch", ["roslaunch", "-"])  # noqa: S606, S607  (found like any ROS program)


def asked(caller: str, parameter: str) -> str:
    """Return a parameter of the ROS master; empty where there is none, or no master answers."""
    uri = os.environ.get("ROS_MASTER_URI", DEFAULT_URI)
    try:
        with xmlrpc.client.ServerProxy(uri) as master:
            answer: Any = master.getParam(caller, parameter)
    except (OSError, xmlrpc.client.Error):
        return ""
    code, _, value = answer
    return str(value) if code == _FOUND else ""


def main() -> None:
    """Start what the parameter holds that this process's argument names."""
    words = [word for word in sys.argv[1:] if ":=" not in word]
    if len(words) != 1 or words[0].startswith("-"):
        sys.exit("usage: launch_checked PARAMETER; to start a fleet, use launch_fleet FLEET")
    space = os.environ.get("ROS_NAMESPACE", "").strip("/")
    name = "/".join(["", *filter(None, [space, words[0]])])
    text = asked("/launch_checked", name)
    if not text:
        sys.exit(
            f"launch_checked: the parameter {name} holds no launch file; to start a fleet, use "
            "launch_fleet FLEET"
        )
    become_roslaunch(text)
