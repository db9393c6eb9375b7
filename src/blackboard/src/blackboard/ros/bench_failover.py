# SPDX-License-Identifier: BSD-3-Clause
"""Measures how long a hive on real ROS is without an active blackboard.

A blackboard node and four robot nodes run on a ROS master of their own; nothing drives, because
only members are needed. Whoever is active is killed (`kill -9`) or stopped (SIGSTOP), and the time
until the first heartbeat of another is taken on the wall clock. It is started again before the
next round.

    rosrun is not needed: python3 -m blackboard.ros.bench_failover [rounds]
"""

from __future__ import annotations

import contextlib
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import rosgraph
import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped

import blackboard.msg as bb_msgs

if TYPE_CHECKING:
    from collections.abc import Iterator

ROBOTS = ("robot1", "robot2", "robot3", "robot4")

_MODEL: dict[str, Any] = {
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

_PATIENCE = 60.0
"""How long the hive may take to be whole again before a round [s]."""

_ANSWERS = 15
"""Answers of each member in a row before a round; by then one that was started again votes too."""

AIMS = {
    "crash_median": 0.5,
    "crash_worst": 1.5,
    "freeze_worst": 3.5,
}
"""From the fault to the first heartbeat of another [s]."""


class FailoverError(Exception):
    """The hive did not come together or did not take over; the text says what was seen."""


class _Members:
    """The processes of the hive.

    Args:
        folder: For journals and logs.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._processes: dict[str, subprocess.Popen[bytes]] = {}

    def start(self, name: str) -> None:
        """Start one member's node, by the node's name."""
        robot = name.strip("/").partition("/")[0] if name != "/blackboard" else ""
        kind = "robot_node" if robot else "blackboard_node"
        command = ["rosrun", "blackboard", kind, "_distance:=euclidean"]
        command.append(f"_journal:={self._folder / 'journals'}")
        if robot:
            command.append(f"__ns:=/{robot}")
        log = (self._folder / f"{name.strip('/').replace('/', '-')}.log").open("ab")
        with log:
            self._processes[name] = subprocess.Popen(  # noqa: S603  (our own nodes)
                command, stdout=log, stderr=log, start_new_session=True
            )

    def signal(self, name: str, what: signal.Signals) -> None:
        """Send a signal to a member and whatever started it."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._processes[name].pid, what)
        if what is signal.SIGKILL:
            self._processes[name].wait()

    def end(self) -> None:
        """End all."""
        for name in self._processes:
            self.signal(name, signal.SIGCONT)
            self.signal(name, signal.SIGKILL)


class _Ear:
    """Notes when the first heartbeat of each new active blackboard comes."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._last: bb_msgs.BbBackup | None = None
        self._firsts: list[tuple[float, str]] = []
        self._acks: dict[str, int] = {}
        rospy.Subscriber("/bb_backup", bb_msgs.BbBackup, self._hear)
        rospy.Subscriber("/bb_ack", bb_msgs.BbAck, self._hear_ack)

    def _hear(self, beat: bb_msgs.BbBackup) -> None:
        with self._changed:
            if self._last is None or beat.epoch > self._last.epoch:
                self._firsts.append((time.monotonic(), beat.active))
            if self._last is None or beat.epoch >= self._last.epoch:
                self._last = beat
            self._changed.notify_all()

    def _hear_ack(self, ack: bb_msgs.BbAck) -> None:
        with self._changed:
            name = ack.member.partition("#")[0]
            same_epoch = self._last is not None and ack.epoch == self._last.epoch
            self._acks[name] = self._acks.get(name, 0) + 1 if same_epoch else 0
            self._changed.notify_all()

    def forget(self) -> None:
        """Forget who has answered so far: something happens to the hive."""
        with self._changed:
            self._acks.clear()

    def _is_whole(self) -> bool:
        """Return whether all have a vote, and all but the active one have answered for a while."""
        last = self._last
        if last is None or len(last.members) <= len(ROBOTS) or not last.backup:
            return False
        others = set(last.members) - {last.active}
        return all(self._acks.get(name, 0) >= _ANSWERS for name in others)

    def wait_until_whole(self) -> str:
        """Return who is active once every member has a vote, answers, and a backup is named."""
        with self._changed:
            whole = self._changed.wait_for(self._is_whole, _PATIENCE)
            if not whole or self._last is None:
                raise FailoverError(f"the hive is not whole after {_PATIENCE:.0f} s: {self._last}")
            return str(self._last.active)

    def wait_for_another(self, than: str, since: float) -> float:
        """Return after how long the first heartbeat of another member came [s]."""

        def another() -> list[float]:
            return [at for at, who in self._firsts if at > since and who != than]

        with self._changed:
            if not self._changed.wait_for(another, _PATIENCE):
                raise FailoverError(f"nobody took over from {than} within {_PATIENCE:.0f} s")
            return another()[0] - since


def _round(members: _Members, ear: _Ear, what: signal.Signals) -> float:
    """Do one fault to whoever is active; return how long there was no active one [s]."""
    active = ear.wait_until_whole()
    ear.forget()
    since = time.monotonic()
    members.signal(active, what)
    gap = ear.wait_for_another(active, since)
    if what is signal.SIGKILL:
        members.start(active)
    else:
        members.signal(active, signal.SIGCONT)
    sys.stderr.write(f"{what.name} of {active}: {gap:.2f} s\n")
    return gap


@contextlib.contextmanager
def _hive() -> Iterator[tuple[_Members, _Ear]]:
    """Run a hive on the ROS master of the environment, which is started where there is none."""
    folder = Path(tempfile.mkdtemp(prefix="robo-hive-failover-"))
    port = rosgraph.get_master_uri().rstrip("/").rpartition(":")[2]
    command = ["rosmaster", "--core", "-p", port]
    with (folder / "rosmaster.log").open("wb") as log:
        master = subprocess.Popen(command, stdout=log, stderr=log)  # noqa: S603  (ROS's own)
    members = _Members(folder)
    try:
        _wait_for_master()
        rospy.init_node("bench_failover", anonymous=True, disable_signals=True)
        poses = []
        for number, robot in enumerate(ROBOTS):
            rospy.set_param(f"/{robot}/characteristics", _MODEL)
            pose = PoseWithCovarianceStamped()
            pose.pose.pose.position.x = float(number)
            pose.pose.pose.orientation.w = 1.0
            topic = f"/{robot}/amcl_pose"
            poses.append(rospy.Publisher(topic, type(pose), latch=True, queue_size=1))
            poses[-1].publish(pose)
        ear = _Ear()
        for name in ("/blackboard", *(f"/{robot}/robot" for robot in ROBOTS)):
            members.start(name)
        yield members, ear
    finally:
        members.end()
        master.kill()
        master.wait()


def _wait_for_master() -> None:
    end = time.monotonic() + _PATIENCE
    while not rosgraph.is_master_online():
        if time.monotonic() > end:
            raise FailoverError(f"no ROS master answers at {rosgraph.get_master_uri()}")
        time.sleep(0.1)


def run(rounds: int = 20) -> dict[str, dict[str, float]]:
    """Measure crashes and freezes.

    Args:
        rounds: How many of each.

    Returns:
        `figures`: median and worst gap for each kind of fault [s]; `aims`: see `AIMS`.
    """
    figures: dict[str, float] = {}
    with _hive() as (members, ear):
        for name, what in (("crash", signal.SIGKILL), ("freeze", signal.SIGSTOP)):
            gaps = [_round(members, ear, what) for _ in range(rounds)]
            figures[f"{name}_median"] = statistics.median(gaps)
            figures[f"{name}_worst"] = max(gaps)
            figures[f"{name}_best"] = min(gaps)
    return {"figures": figures, "aims": AIMS}


if __name__ == "__main__":
    sys.stdout.write(f"{run(int(sys.argv[1]) if len(sys.argv) > 1 else 20)}\n")
