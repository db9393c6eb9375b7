# SPDX-License-Identifier: BSD-3-Clause
"""A whole hive on this machine: its ROS master, and `fleet_manager.launch` on it.

The master is spoken to in XML-RPC, which the standard library knows; ROS itself is imported later,
by the link, because it reads the environment that is set here.
"""

from __future__ import annotations

import contextlib
import os
import re
import socket
import tempfile
import time
import xmlrpc.client
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from fleet_manager.client.client import DEFAULT_URI
from fleet_manager.demo.ports import reserved_port
from fleet_manager.demo.processes import ProcessGroup
from fleet_manager.errors import InputError, StartError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

_MASTER_WITHIN = 60.0
_LOOK_EVERY = 0.1
_CALLER = "/hive_demo"
_LOG_TAIL = 6
_TERMINAL_CODES = re.compile(r"\x1b(\[[0-9;]*[A-Za-z]|\][^\x07]*\x07)")
"""Colours and window titles, which roslaunch writes into files too."""


class LocalHive:
    """A running ROS master and what was launched on it.

    Attributes:
        uri: The master's address.
        processes: What runs.
        folder: Where the hive leaves its files.
    """

    def __init__(self, uri: str, processes: ProcessGroup, folder: Path) -> None:
        self.uri = uri
        self.processes = processes
        self.folder = folder

    def start_master(self) -> None:
        """Start a ROS master at the address, unless one answers there already.

        Raises:
            StartError: It did not come up, or a hive is running on the one that answers.
        """
        if self._master_answers():
            self._demand_no_hive()
            return
        port = urlsplit(self.uri).port
        self.processes.start("roscore", ["roscore", "-p", str(port)])
        end = time.monotonic() + _MASTER_WITHIN
        while not self._master_answers():
            self.check()
            if time.monotonic() > end:
                raise StartError(f"roscore does not answer at {self.uri}; {self._tail('roscore')}")
            time.sleep(_LOOK_EVERY)

    def launch(self, arguments: Mapping[str, str]) -> None:
        """Start `fleet_manager.launch` with simulated time.

        Args:
            arguments: Of the launch file, by name.
        """
        with xmlrpc.client.ServerProxy(self.uri) as master:
            master.setParam(_CALLER, "/use_sim_time", True)
            # A hive that was interrupted goes on when it is started again; this is another one.
            journal = tempfile.mkdtemp(prefix="journal-", dir=self.folder)
            master.setParam(_CALLER, "/journal", journal)
        words = [f"{name}:={value}" for name, value in arguments.items()]
        self.processes.start(
            "fleet_manager", ["roslaunch", "fleet_manager", "fleet_manager.launch", *words]
        )

    def process_of(self, node: str) -> int:
        """Return the process id of a node, given by its name with a slash in front."""
        with xmlrpc.client.ServerProxy(self.uri) as master:
            found: Any = master.lookupNode(_CALLER, node)
        with xmlrpc.client.ServerProxy(found[2]) as answerer:
            answer: Any = answerer.getPid(_CALLER)
        return int(answer[2])

    def check(self) -> None:
        """Raise StartError where a process has ended by itself; the text has its last words."""
        ended = self.processes.ended()
        if ended is not None:
            raise StartError(f"{ended} has ended by itself; {self._tail(ended)}")

    def why_missing(self) -> str:
        """Return what the launch says of nodes that died; empty where it says nothing."""
        with contextlib.suppress(OSError):
            text = self.processes.log("fleet_manager").read_text(errors="replace")
            died = [line.strip() for line in text.splitlines() if "process has died" in line]
            return "; ".join(line.split("]", 1)[0].lstrip("[") + "] died" for line in died)
        return ""

    def _master_answers(self) -> bool:
        try:
            with xmlrpc.client.ServerProxy(self.uri) as master:
                master.getPid(_CALLER)
        except (OSError, xmlrpc.client.Error):
            return False
        return True

    def _demand_no_hive(self) -> None:
        with xmlrpc.client.ServerProxy(self.uri) as master:
            state: Any = master.getSystemState(_CALLER)
        publishers = state[2][0]
        if any(topic == "/bb_backup" for topic, _ in publishers):
            raise StartError(
                f"a hive is running on the ROS master at {self.uri} already; "
                "end it, or unset ROS_MASTER_URI so that this one gets a master of its own"
            )

    def _tail(self, name: str) -> str:
        """Return the last lines of a process's output, and where the rest is."""
        path = self.processes.log(name)
        with contextlib.suppress(OSError):
            lines = [
                line for line in path.read_text(errors="replace").splitlines() if line.strip()
            ]
            return f"its last words ({path}):\n  " + "\n  ".join(lines[-_LOG_TAIL:])
        return f"it left nothing in {path}"


@contextlib.contextmanager
def local_hive(folder: Path) -> Iterator[LocalHive]:
    """Give a hive a place to run: a master's address, the environment, and an end.

    The address is that of ROS_MASTER_URI where the user has given one, else a free port of this
    machine. The default address counts as not given, because catkin's setup.bash sets it. The
    environment of this process is set to the address, so that the link finds the same master.

    Args:
        folder: For the logs of all processes.

    Yields:
        The hive, with nothing started yet. At the end every process of it is ended.

    Raises:
        InputError: ROS_MASTER_URI is no address of this machine.
        StartError: No port is free.
    """
    with contextlib.ExitStack() as stack:
        given = os.environ.get("ROS_MASTER_URI", DEFAULT_URI).rstrip("/")
        if given == DEFAULT_URI:
            port = stack.enter_context(reserved_port())
            uri = f"http://127.0.0.1:{port}"
        else:
            uri = _checked(given)
        logs = (folder / "log").resolve()
        os.environ.update(ROS_MASTER_URI=uri, ROS_IP="127.0.0.1", ROS_LOG_DIR=str(logs))
        os.environ.pop("ROS_HOSTNAME", None)
        os.environ.pop("ROS_NAMESPACE", None)
        processes = ProcessGroup(logs, os.environ)
        stack.callback(processes.stop)
        yield LocalHive(uri, processes, folder.resolve())


def _checked(uri: str) -> str:
    """Return the address of a master on this machine, or refuse it."""
    try:
        parts = urlsplit(uri)
        port, host = parts.port, parts.hostname
        local = host in {"localhost", "127.0.0.1", "::1", socket.gethostname()}
    except ValueError:
        port, local = None, False
    if port is None or not local:
        raise InputError(
            f"ROS_MASTER_URI is {uri}; a hive is started on this machine only: "
            "allowed is http://127.0.0.1:PORT, or unset it"
        )
    return uri
