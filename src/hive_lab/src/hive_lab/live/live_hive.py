# SPDX-License-Identifier: BSD-3-Clause
"""The processes of a real hive without a world, for tests and benchmarks that kill them.

A hive is a blackboard node and some robot nodes in a namespace of their own, so several hives can
share a ROS master. `fake_base.FakeBase` drives the robots.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import rosgraph
import rospy

from blackboard.domain.settings import STANDING_BY
from blackboard.errors import LiveHiveError
from hive_common.resources import node_file
from hive_lab.live.fake_base import FakeBase
from hive_lab.live.live_operator import LiveOperator

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

ROBOTS = ("robot1", "robot2", "robot3", "robot4")

MODEL: dict[str, Any] = {
    "base": {
        "mass": 50.0,
        "max_speed": 1.0,
        "friction_coefficient": 0.02,
        "footprint": [[0.3, 0.3], [-0.3, 0.3], [-0.3, -0.3], [0.3, -0.3]],
    },
    "payload": 20.0,
    "battery": {
        "capacity": 20.0,
        "voltage_full": 28.0,
        "voltage_empty": 22.0,
        "charging_time": 3600.0,
        "idle_power": 20.0,
    },
    "capabilities": ["GA", "GAB"],
}
"""A robot without an arm; robot_description/models has real ones."""

_MASTER_WITHIN = 60.0
_LOOK_EVERY = 0.05


class LiveHive:
    """The processes of one hive, by node name.

    Args:
        folder: For journals and logs.
        namespace: Of the hive, beginning and ending in a slash.
        robots: Names of its robots.
        blackboard: Further private parameters of the blackboard node.
        robot: Further private parameters of every robot node.
        standing_by: How many robots are voters, the first ones.
    """

    def __init__(
        self,
        folder: Path,
        namespace: str = "/",
        robots: Sequence[str] = ROBOTS,
        blackboard: Mapping[str, Any] | None = None,
        robot: Mapping[str, Any] | None = None,
        standing_by: int = STANDING_BY,
    ) -> None:
        self._folder = folder
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self.namespace = namespace
        self.robots = tuple(robots)
        self.blackboard = f"{namespace}blackboard"
        common = {"distance": "euclidean", "journal": str(self.journals)}
        self._parameters: dict[str, Any] = {self.blackboard: {**common, **(blackboard or {})}}
        for name in self.robots:
            self._parameters[f"{namespace}{name}/characteristics"] = MODEL
            own = {**common, "stands_by": name in self.robots[:standing_by]}
            self._parameters[self.node_of(name)] = {**own, **(robot or {})}
        self.set_parameters()

    def set_parameters(self) -> None:
        """Set the parameters of all nodes on the ROS master; a new master lacks them."""
        for name, value in self._parameters.items():
            rospy.set_param(name, value)

    @property
    def journals(self) -> Path:
        """The folder of all journals."""
        return self._folder / "journals"

    @property
    def members(self) -> tuple[str, ...]:
        """Names of all initial nodes."""
        return (self.blackboard, *map(self.node_of, self.robots))

    def node_of(self, robot: str) -> str:
        """Return the name of a robot's node."""
        return f"{self.namespace}{robot}/robot"

    def robot_of(self, node: str) -> str:
        """Return the robot that a node belongs to; empty for the blackboard node."""
        return node.rsplit("/", 2)[-2] if node.endswith("/robot") else ""

    def journal_of(self, node: str) -> Path:
        """Return the file of a node's journal."""
        return self.journals / f"{node.strip('/').replace('/', '-')}.sqlite3"

    def log_of(self, node: str) -> str:
        """Return a node's output so far."""
        return self._log(node).read_text(errors="replace")

    def start_all(self) -> None:
        """Start every node of the hive."""
        for name in self.members:
            self.start(name)

    def start(
        self,
        node: str,
        *arguments: str,
        program: Sequence[str] = (),
        prefix: Sequence[str] = (),
        environment: Mapping[str, str] | None = None,
    ) -> None:
        """Start a node.

        Args:
            node: Its name; one that ends in `/robot` is a robot's, any other a blackboard's.
            arguments: Further ones, such as remappings.
            program: Replaces the package's own node.
            prefix: Command that runs it, such as `ip netns exec robot1`.
            environment: Additions to this process's environment.
        """
        space, _, name = node.rpartition("/")
        kind = "robot_node" if name == "robot" else "blackboard_node"
        own = (sys.executable, str(node_file("blackboard", kind)))
        command = [*prefix, *(program or own)]
        command += [f"__ns:={space or '/'}", f"__name:={name}", *arguments]
        self._folder.mkdir(parents=True, exist_ok=True)
        with self._log(node).open("ab") as log:
            self._processes[node] = subprocess.Popen(  # noqa: S603  (our own nodes)
                command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env={**os.environ, "PYTHONUNBUFFERED": "1", **(environment or {})},
                start_new_session=True,
            )

    def signal(self, node: str, what: signal.Signals) -> None:
        """Send a signal to a node's process group; after SIGKILL wait for its end."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._processes[node].pid, what)
        if what is signal.SIGKILL:
            self._processes[node].wait()

    def kill(self, *nodes: str) -> None:
        """Kill nodes (SIGKILL)."""
        for node in nodes:
            self.signal(node, signal.SIGKILL)

    def freeze(self, node: str) -> None:
        """Suspend a node (SIGSTOP)."""
        self.signal(node, signal.SIGSTOP)

    def thaw(self, node: str) -> None:
        """Resume a suspended node (SIGCONT)."""
        self.signal(node, signal.SIGCONT)

    def ended(self) -> tuple[str, ...]:
        """Return the started nodes that do not run any more."""
        return tuple(name for name, each in self._processes.items() if each.poll() is not None)

    def pids(self) -> tuple[int, ...]:
        """Return the process ids of the running nodes."""
        return tuple(each.pid for each in self._processes.values() if each.poll() is None)

    def pid_of(self, node: str) -> int:
        """Return the process id of a started node."""
        return self._processes[node].pid

    def restart_ended(self) -> None:
        """Restart the nodes that do not run any more."""
        for name in self.ended():
            self.start(name)

    def end(self) -> None:
        """Kill every node."""
        for name in self._processes:
            self.kill(name)

    def _log(self, node: str) -> Path:
        return self._folder / f"{node.strip('/').replace('/', '-')}.log"


class Master:
    """A ROS master at the address of the environment; its log goes to a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def is_running(self) -> bool:
        """Whether it runs."""
        return self._process is not None and self._process.poll() is None

    def start(self) -> None:
        """Start it and wait until it answers."""
        uri = rosgraph.get_master_uri()
        command = ["rosmaster", "--core", "-p", uri.rstrip("/").rpartition(":")[2]]
        with (self._folder / "rosmaster.log").open("ab") as log:
            self._process = subprocess.Popen(  # noqa: S603  (ROS's own)
                command, stdout=log, stderr=log, start_new_session=True
            )
        end = time.monotonic() + _MASTER_WITHIN
        while not rosgraph.is_master_online():
            if time.monotonic() > end:
                raise LiveHiveError(f"no ROS master answers at {uri}")
            time.sleep(_LOOK_EVERY)

    def kill(self) -> None:
        """Kill it (SIGKILL)."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()


@contextlib.contextmanager
def own_master(folder: Path) -> Iterator[Master]:
    """Run a ROS master at the address of the environment; kill it afterwards."""
    master = Master(folder)
    try:
        master.start()
        yield master
    finally:
        master.kill()


@contextlib.contextmanager
def bench_hive(node: str) -> Iterator[tuple[LiveHive, LiveOperator]]:
    """Run a hive with fake bases on a ROS master of its own; `node` names this process."""
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="robo-hive-bench-")))
        stack.enter_context(own_master(folder))
        rospy.init_node(node, anonymous=True, disable_signals=True)
        stack.callback(rospy.signal_shutdown, "what follows ends the master")
        hive = LiveHive(folder)
        stack.callback(hive.end)
        bases = [FakeBase(f"/{name}", x=float(i)) for i, name in enumerate(hive.robots)]
        operator = LiveOperator(hive.namespace, hive.members)
        hive.start_all()
        yield hive, operator
        bases.clear()
