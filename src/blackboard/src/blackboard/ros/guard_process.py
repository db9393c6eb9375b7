# SPDX-License-Identifier: BSD-3-Clause
"""The process beside a robot's process that ends its drives when that hangs or has ended.

Run as a program, this module is that process. It reads what the robot's process tells of its
drives from its standard input, which ends when that process does, however it ends. It becomes a
node only when it may soon have to cancel a goal, and loads rospy before that, in a quiet moment.
"""

from __future__ import annotations

import json
import math
import os
import random
import select
import signal
import subprocess
import sys
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from blackboard.robot.drive_guard import Drive, DriveGuard
from hive_common.machine_clock import machine_time

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

_MOST_READ = 65536
_LONGEST_WAIT = 1.0
"""So often it looks at its clock while it guards a drive [s]: a wait does not count the time that
the machine sleeps, and a lease does."""

_READY = 1.5
"""So long before it has to cancel a goal it becomes a node [s], which takes a while. Leases are
renewed earlier than that, unless something is wrong."""

_LOADS_AFTER = (10.0, 40.0)
"""Between these times after its start [s], drawn so that not all guards of a machine do it at
once, it loads rospy as soon as it guards no drive. That takes ten times the processor time of
becoming a node. When a fleet on one machine lost its leader in a burst of tasks, guards that
loaded it because all leases were about to end took a quarter of the processor time, and the next
leader was lost as well (docs/benchmarks.md, auction)."""

_CONNECTED_WITHIN = 2.0
"""Time in which a navigation that is there hears the guard [s]; else it is gone as well."""

_LOOK_EVERY = 0.01
_SAID = 0.3
"""Time that a message has to leave this process before it ends [s]."""

_WARN_EVERY = 30.0
_LAST = 10
"""After this time the guard of a process that has ended gives up [s]: there is no master."""


class GuardProcess:
    """A `Guard` in a process of its own.

    It is started at once: to start a process takes more processor time than a task's auction, and
    in a burst of tasks all robots of a fleet begin to drive.
    """

    def __init__(self) -> None:
        self._held: dict[Drive, float] = {}
        self._process = _start()

    def hold(self, drive: Drive, until: float) -> None:
        """See `Guard.hold`."""
        self._held[drive] = until
        self._say((*drive, until))

    def drop(self, drive: Drive) -> None:
        """See `Guard.drop`."""
        if self._held.pop(drive, None) is not None:
            self._say((*drive, None))

    def _say(self, line: Sequence[str | float | None]) -> None:
        """Tell the process; one that has ended is started again and told everything."""
        if self._process is None or self._process.poll() is not None:
            self._process = _start()
            lines: list[Sequence[str | float | None]] = [
                (*drive, until) for drive, until in self._held.items()
            ]
        else:
            lines = [line]
        if self._process is None or self._process.stdin is None:
            return
        said = "".join(f"{json.dumps(each)}\n" for each in lines).encode()
        with suppress(BlockingIOError, BrokenPipeError):  # the next one comes within a second
            os.write(self._process.stdin.fileno(), said)


def _start() -> subprocess.Popen[bytes] | None:
    try:
        process = subprocess.Popen(
            [sys.executable, "-m", "blackboard.ros.guard_process"],
            stdin=subprocess.PIPE,
            start_new_session=True,  # whoever kills the robot's group leaves the guard alone
        )
    except OSError as error:
        _rospy().logwarn_throttle(
            _WARN_EVERY,
            f"the guard that stops robots when this process ends cannot start: {error}; until it "
            "can, they would drive on to their goals",
        )
        return None
    assert process.stdin is not None  # noqa: S101  (it is a pipe)
    os.set_blocking(process.stdin.fileno(), False)
    return process


def main() -> None:
    """Cancel each drive whose lease ends, until the robot's process ends; then what is left."""
    guard, said = DriveGuard(), b""
    loads_at = machine_time() + random.uniform(*_LOADS_AFTER)  # noqa: S311  (no secret)
    while True:
        left = guard.next_due - machine_time()
        if math.isinf(left) and machine_time() >= loads_at:
            _rospy()
            loads_at = math.inf
        if left < _READY:
            _become_node()
        else:
            left -= _READY
        ready, _, _ = select.select([sys.stdin], [], [], wait_for(left, loads_at))
        if ready:
            heard = os.read(sys.stdin.fileno(), _MOST_READ)
            if not heard:
                break
            *lines, said = (said + heard).split(b"\n")
            for line in lines:
                _take(guard, line)
        _cancel(guard.due(machine_time()), "its robot's lease has ended and was not renewed")
    signal.alarm(_LAST)
    _cancel(guard.left(), "its robot's process has ended")


def wait_for(left: float, loads_at: float = math.inf) -> float | None:
    """Return for how long to wait at most [s]; None without end.

    Args:
        left: Time until something is due [s]; infinite if nothing is guarded.
        loads_at: When rospy is to be loaded, by the machine's clock [s]; infinite once it is.
    """
    if math.isinf(left):
        return None if math.isinf(loads_at) else max(loads_at - machine_time(), 0.0)
    return min(max(left, 0.0), _LONGEST_WAIT)


def _take(guard: DriveGuard, line: bytes) -> None:
    action, goal, until = json.loads(line)
    if until is None:
        guard.drop(Drive(action, goal))
    else:
        guard.hold(Drive(action, goal), until)


def _cancel(drives: Collection[Drive], why: str) -> None:
    """Cancel goals of navigations that listen."""
    heard = _heard() if drives else ()
    wanted = [drive for drive in drives if f"{drive.action}/cancel" in heard]
    if not wanted:
        return
    from actionlib_msgs.msg import GoalID  # noqa: PLC0415  (as in `_rospy`)

    _become_node()
    rospy = _rospy()
    publishers = {
        drive: rospy.Publisher(f"{drive.action}/cancel", GoalID, queue_size=1) for drive in wanted
    }
    waiting = dict(publishers)
    give_up = machine_time() + _CONNECTED_WITHIN
    while waiting and machine_time() < give_up:
        for drive in [each for each in waiting if waiting[each].get_num_connections()]:
            waiting.pop(drive).publish(GoalID(id=drive.goal))
            rospy.logwarn(f"cancelled the goal of {drive.action}, because {why}")
        time.sleep(_LOOK_EVERY)
    time.sleep(_SAID)
    for publisher in publishers.values():
        publisher.unregister()


def _rospy() -> Any:  # noqa: ANN401  (rospy has no types)
    """Import rospy, which takes half a second."""
    import rospy  # noqa: PLC0415

    return rospy


def _become_node() -> None:
    """Make this process a node, unless it is one or there is no master."""
    rospy = _rospy()
    if not rospy.core.is_initialized() and _heard():
        rospy.init_node("drive_guard", anonymous=True, disable_signals=True)


def _heard() -> Collection[str]:
    """Return the topics to which somebody listens; none if there is no master."""
    import rosgraph  # noqa: PLC0415  (as in `_rospy`)

    try:
        _, subscribed, _ = rosgraph.Master("/drive_guard").getSystemState()
    except (OSError, rosgraph.MasterException):
        return ()
    return {name for name, _ in subscribed}


if __name__ == "__main__":
    main()
