# SPDX-License-Identifier: BSD-3-Clause
"""The traffic planner's process beside the member that leads, and what it is told at its start.

The planner keeps nothing on disk. The zones that an operator has closed are told to all on
`traffic_state`; every member that can lead remembers them, and tells them to the planner that it
starts. So they stay closed when the planner's machine is lost.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import subprocess
import sys
import weakref
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING

import rospy
from robot_description.msg import TrafficState
from std_msgs.msg import Header

from blackboard.board.planner_keeper import PlannerKeeper, Progress
from hive_common.resources import node_file
from hive_common.ros.zones import zones_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from blackboard.consensus.node import RaftNode
    from blackboard.process.talker import MemberTalker

_PROGRAM = ("hive_navigation", "traffic_planner")
"""The node that plans: its package and its type, as in a launch file."""

_MOST_WORDS = 65536
"""So many bytes of what a planner says of its progress are read at once."""

_OWN = 10
"""Messages of one's own that may still be on their way."""

_USER_TIME = 11
"""Place of the user time among the words behind the name in /proc/*/stat; system time follows."""


class PlannerProcess:
    """A traffic planner that runs; see `blackboard.board.planner_keeper.Child`.

    It ends when its standard input does, so it never outlives this process.
    """

    def __init__(self, hive: str, parameters: Sequence[str]) -> None:
        """Start it in a hive's namespace; `parameters` are ROS's arguments `_name:=value`.

        Raises:
            OSError: The system allows no more processes.
            FileError: The planner is not installed.
        """
        node = node_file(*_PROGRAM)
        self._words, its_end = os.pipe()
        os.set_blocking(self._words, False)
        try:
            # This interpreter runs it, because rosrun takes half a second to look for it.
            self._process = subprocess.Popen(  # noqa: S603  (our own program)
                [sys.executable, node, f"--progress={its_end}", *parameters],
                stdin=subprocess.PIPE,
                pass_fds=[its_end],
                env={**os.environ, "ROS_NAMESPACE": hive},
            )
        except OSError:
            os.close(self._words)
            raise
        finally:
            os.close(its_end)
        weakref.finalize(self, os.close, self._words)
        self._said = b""
        self._progress = Progress()

    def progress(self) -> Progress:
        """Return how far it is with being loaded."""
        with contextlib.suppress(BlockingIOError):  # it has said nothing new
            self._said += os.read(self._words, _MOST_WORDS)
        *lines, self._said = self._said.split(b"\n")
        steps, doing, _ = self._progress
        if lines:
            steps, doing = steps + len(lines), lines[-1].decode(errors="replace")
        self._progress = Progress(steps, doing, _worked(self._process.pid))
        return self._progress

    def ended(self) -> str:
        """Return how it has ended; empty while it runs."""
        code = self._process.poll()
        if code is None:
            return ""
        if code == 0:
            return "by itself, as it does when the map or the clock is another one"
        return f"signal {-code}" if code < 0 else f"exit code {code}"

    def end(self) -> None:
        """Ask it to end."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        self._process.terminate()

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()


def _worked(process: int) -> float:
    """Return the processor time of a process's main thread [s]; 0 where it cannot be read."""
    try:
        stat = Path(f"/proc/{process}/task/{process}/stat").read_text(encoding="utf-8")
    except OSError:
        return 0.0
    user, system = stat.rpartition(")")[2].split()[_USER_TIME : _USER_TIME + 2]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


class LastWord:
    """What the planner of the highest epoch has told last: the zones that are closed.

    Args:
        hive: Namespace of the hive, ending in a slash.
        closed: The zones that are closed at first.
        now: Returns the time [s].

    ROS Subscribers: `traffic_state` (robot_description/TrafficState).
    """

    def __init__(self, hive: str, closed: Sequence[str], now: Callable[[], float]) -> None:
        self.closed = closed
        self._epoch, self._at, self._now = 0, -math.inf, now
        self._own: deque[int] = deque(maxlen=_OWN)  # numbers, which one thread compares at once
        rospy.Subscriber(f"{hive}traffic_state", TrafficState, self._hear, queue_size=1)

    def _hear(self, msg: TrafficState) -> None:
        # Their node does not tell them apart: a relay in this process brings in what others say.
        if msg.header.stamp.to_nsec() in self._own:
            return
        if msg.epoch >= self._epoch:
            self._epoch, self._at, self.closed = msg.epoch, self._now(), tuple(msg.closed)

    def note_own(self, stamp: rospy.Time) -> None:
        """Ignore a message of this member's, which it sends while no planner plans."""
        self._own.append(stamp.to_nsec())

    def at(self, epoch: int) -> float:
        """Return when a planner of an epoch was heard last [s]; -inf if it was not."""
        return self._at if self._epoch == epoch else -math.inf


def keep_planner(talker: MemberTalker, node: RaftNode, hive: str) -> None:
    """Have the traffic planner run while a member leads; `hive` ends in a slash.

    ROS Subscribers: `traffic_state` (robot_description/TrafficState).
    ROS Publishers: `traffic_state`, once a second while this member leads and no planner plans.
    ROS Parameters: `traffic_planner/zones` and `traffic_planner/places` of the hive, read once: a
        new master knows none.
    """
    zones = rospy.get_param(f"{hive}traffic_planner/zones", [])
    places = rospy.get_param(f"{hive}traffic_planner/places", [])
    shut = [zone.name for zone in zones_of(hive) if zone.closed]
    last = LastWord(hive, shut, talker.now)

    def leads() -> int | None:
        return node.epoch if node.may_act() else None

    def launch(epoch: int) -> PlannerProcess:
        known = {"epoch": epoch, "zones": zones, "closed": last.closed, "places": places}
        return PlannerProcess(hive, [f"_{k}:={json.dumps(v)}" for k, v in known.items()])

    names = [zone.name for zone in zones_of(hive)]
    publisher = rospy.Publisher(f"{hive}traffic_state", TrafficState, queue_size=1)

    def tell(epoch: int, why: str) -> None:
        header = Header(stamp=rospy.Time.now(), frame_id="map")
        last.note_own(header.stamp)
        publisher.publish(
            TrafficState(
                header=header, epoch=epoch, zones=names, closed=list(last.closed), status=why
            )
        )

    keeper = PlannerKeeper(talker, leads, last.at, launch, tell)
    keeper.start()
    rospy.on_shutdown(keeper.stop)
