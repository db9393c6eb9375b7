# SPDX-License-Identifier: BSD-3-Clause
"""A whole hive on this machine: its ROS master, and `fleet_manager.launch` on it.

This module calls the master with the standard library's XML-RPC. The link imports ROS later,
because ROS reads the environment that is set here.
"""

from __future__ import annotations

import contextlib
import os
import socket
import tempfile
import time
import xmlrpc.client
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from fleet_manager.client.client import DEFAULT_URI
from fleet_manager.demo.machine import reserved_port
from fleet_manager.demo.processes import ProcessGroup
from fleet_manager.errors import InputError, StartError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from fleet_manager.client.client import HiveClient
    from fleet_manager.client.hive_state import HiveState

_MASTER_WITHIN = 60.0
_LOOK_EVERY = 0.1
_CALLER = "/hive_demo"
_LOG_TAIL = 6
_NAMED = 6  # so many are named before the rest is counted
START_WITHIN = 120.0
"""Time for the blackboard and every robot to start [s]; it takes about ten on a quiet machine,
half a minute on a busy one with two cores."""


class LocalHive:
    """A ROS master and what was launched on it."""

    def __init__(self, uri: str, processes: ProcessGroup, folder: Path) -> None:
        self.uri = uri  # the master's address
        self.processes = processes  # the running processes
        self.folder = folder  # the folder of the hive's files

    def start_master(self) -> None:
        """Start a ROS master at the address, unless one answers there already.

        Raises:
            StartError: It did not start, or a hive is running on the one that answers.
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
        """Start `fleet_manager.launch` with arguments and simulated time."""
        with xmlrpc.client.ServerProxy(self.uri) as master:
            master.setParam(_CALLER, "/use_sim_time", True)
            # An interrupted hive goes on from its journal; this is a new hive.
            journal = tempfile.mkdtemp(prefix="journal-", dir=self.folder)
            master.setParam(_CALLER, "/journal", journal)
        words = [f"{name}:={value}" for name, value in arguments.items()]
        self.processes.start(
            "fleet_manager", ["roslaunch", "fleet_manager", "fleet_manager.launch", *words]
        )

    def process_of(self, node: str) -> int:
        """Return the process id of a node; its name begins with a slash."""
        with xmlrpc.client.ServerProxy(self.uri) as master:
            found: Any = master.lookupNode(_CALLER, node)
        with xmlrpc.client.ServerProxy(found[2]) as answerer:
            answer: Any = answerer.getPid(_CALLER)
        return int(answer[2])

    def check(self) -> None:
        """Raise StartError, with the last output, where a process ended unexpectedly."""
        ended = self.processes.ended()
        if ended is not None:
            raise StartError(f"{ended} ended unexpectedly; {self._tail(ended)}")

    def why_missing(self) -> str:
        """Return the nodes that died, according to roslaunch; empty where none did."""
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
                f"a hive is already running on the ROS master at {self.uri}; "
                "end it, or unset ROS_MASTER_URI so that this one gets a master of its own"
            )

    def _tail(self, name: str) -> str:
        """Return the last lines of a process's output, and the path of the rest."""
        path = self.processes.log(name)
        with contextlib.suppress(OSError):
            lines = [
                line for line in path.read_text(errors="replace").splitlines() if line.strip()
            ]
            return f"its last output ({path}):\n  " + "\n  ".join(lines[-_LOG_TAIL:])
        return f"it wrote nothing to {path}"


@contextlib.contextmanager
def local_hive(folder: Path) -> Iterator[LocalHive]:
    """Prepare a hive on this machine with logs in `folder`, and end all its processes at the end.

    Its master's address is ROS_MASTER_URI where the user has set one, else a free port. The
    default address counts as not set, because catkin's setup.bash sets it. The environment of this
    process gets the address, so that the link finds the same master.

    Raises:
        InputError: ROS_MASTER_URI is not an address of this machine.
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
    """Return the address of a master, if it is on this machine."""
    try:
        parts = urlsplit(uri)
        port, host = parts.port, parts.hostname
        local = host in {"localhost", "127.0.0.1", "::1", socket.gethostname()}
    except ValueError:
        port, local = None, False
    if port is None or not local:
        raise InputError(
            f"ROS_MASTER_URI is {uri}; a hive starts on this machine only: "
            "allowed is http://127.0.0.1:PORT, or unset it"
        )
    return uri


def wait_for_everyone(
    client: HiveClient,
    robots: Sequence[str],
    hive: LocalHive,
    within: float = START_WITHIN,
    tell: Callable[[str], object] = len,
) -> None:
    """Wait up to `within` [s] until the blackboard is heard, and it has heard every robot.

    A task posted earlier might be split among the robots that are there already. `tell` gets a
    line whenever it changes what is waited for.

    Raises:
        StartError: Some were not heard, or a process ended unexpectedly.
    """
    end = client.link.now() + within
    told: list[str] = []
    while awaited := missing(client.state, robots):
        if awaited != told:
            told = awaited
            tell(f"waiting for {_listed(awaited)}\n")
        client.pump(lambda: not missing(client.state, robots), 0.5)
        hive.check()
        if client.link.now() > end:
            died = hive.why_missing()
            why = f" ({died})" if died else ""
            raise StartError(
                f"not heard within {within:g} s: {', '.join(missing(client.state, robots))}{why}; "
                f"the logs are in {hive.processes.folder}"
            )


def _listed(names: Sequence[str]) -> str:
    """Return the first few names, and how many more there are."""
    more = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {more} more" if more > 0 else "")


def missing(state: HiveState, robots: Sequence[str]) -> list[str]:
    """Return who has not been heard yet, the blackboard first."""
    if state.heartbeat is None:
        return ["the blackboard", *(name for name in robots if name not in state.robots)]
    known = state.robots.keys() & state.heartbeat.heard.keys()
    return [name for name in robots if name not in known]
