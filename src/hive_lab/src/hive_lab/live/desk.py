# SPDX-License-Identifier: BSD-3-Clause
"""Programs that post tasks to a live hive and hear when each is assigned, over ROS or Zenoh."""

from __future__ import annotations

import random
import sys
import threading
import time
from typing import TYPE_CHECKING, Any, Protocol

import blackboard.msg as bb_msgs
import rospy
import zenoh
from std_msgs.msg import String
from zenoh.handlers import Callback

from blackboard.errors import LiveHiveError
from blackboard.zenoh.access import key_of, keys_for
from blackboard.zenoh.link import deserialized, serialized
from blackboard.zenoh.opening import open_session
from hive_lab.live.live_operator import TERMINAL, make_task
from hive_lab.live.zenoh_hive import OPERATOR

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from hive_lab.live.zenoh_hive import ZenohHive

_PATIENCE = 60.0
_WHOLE_LIST = 300.0  # time for all tasks on a large hive's list to be cancelled [s]
_REPEAT = 5.0


class Wire(Protocol):
    """How a desk speaks to a hive."""

    def post(self, task: bb_msgs.TaskMsg) -> None:
        """Post a task."""

    def cancel(self, task_id: str) -> None:
        """Cancel a task."""

    def follow(self, hear: Callable[[Any], None]) -> None:
        """Call with each TaskState that comes, in a thread of its own."""

    @property
    def is_heard(self) -> bool:
        """Whether the hive is connected in both directions."""


class RosWire:
    """Speaks over ROS. Create it after `rospy.init_node`.

    The namespace is the hive's and ends in a slash.

    ROS Publishers: `new_task`, `task_cancel`.
    ROS Subscribers: `task_state`.
    """

    def __init__(self, namespace: str) -> None:
        self._namespace = namespace
        self._post = rospy.Publisher(
            f"{namespace}new_task", bb_msgs.TaskMsg, queue_size=1000, tcp_nodelay=True
        )
        self._cancel = rospy.Publisher(f"{namespace}task_cancel", String, queue_size=1000)
        self._ear: rospy.Subscriber | None = None

    def post(self, task: bb_msgs.TaskMsg) -> None:
        """See `Wire`."""
        self._post.publish(task)

    def cancel(self, task_id: str) -> None:
        """See `Wire`."""
        self._cancel.publish(task_id)

    def follow(self, hear: Callable[[Any], None]) -> None:
        """See `Wire`."""
        self._ear = rospy.Subscriber(
            f"{self._namespace}task_state", bb_msgs.TaskState, hear, tcp_nodelay=True
        )

    @property
    def is_heard(self) -> bool:
        """See `Wire`."""
        ear = self._ear
        return bool(ear and self._post.get_num_connections() and ear.get_num_connections())


class ZenohWire:
    """Speaks over Zenoh, with the certificate of the hive's operator."""

    def __init__(self, hive: ZenohHive) -> None:
        self._hive, self._robots = hive.site.name, hive.robots
        self._session = open_session(hive.operator_settings().session())
        self._post, self._cancel = map(self._publisher, ("new_task", "task_cancel"))

    def _publisher(self, topic: str) -> zenoh.Publisher:
        return self._session.declare_publisher(
            key_of(self._hive, topic, OPERATOR),
            congestion_control=zenoh.CongestionControl.BLOCK,
        )

    def post(self, task: bb_msgs.TaskMsg) -> None:
        """See `Wire`."""
        self._post.put(serialized(task))

    def cancel(self, task_id: str) -> None:
        """See `Wire`."""
        self._cancel.put(serialized(String(task_id)))

    def follow(self, hear: Callable[[Any], None]) -> None:
        """See `Wire`."""

        def read(sample: zenoh.Sample) -> None:
            hear(deserialized(bb_msgs.TaskState, sample.payload))

        for key in keys_for(self._hive, "task_state", ""):
            self._session.declare_subscriber(key, Callback(read, indirect=False))

    def wait_for_robots(self, robots: Iterable[str], patience: float) -> None:
        """Wait until robots are heard [s]."""
        silent = set(robots)
        changed = threading.Condition()

        def note(sample: zenoh.Sample) -> None:
            with changed:
                silent.discard(str(sample.key_expr).split("/")[3])
                changed.notify_all()

        keys = keys_for(self._hive, "robot_status", "")
        ears = [self._session.declare_subscriber(key, note) for key in keys]
        with changed:
            if not changed.wait_for(lambda: not silent, patience):
                raise LiveHiveError(f"{len(silent)} robots are not heard within {patience:.0f} s")
        for each in ears:
            each.undeclare()  # type: ignore[no-untyped-call]

    @property
    def is_heard(self) -> bool:
        """See `Wire`."""
        info = self._session.info
        has_router = any(info.routers_zid())
        return has_router or len(list(info.peers_zid())) == 1 + len(self._robots)

    def close(self) -> None:
        """Leave the hive."""
        self._session.close()  # type: ignore[no-untyped-call]


class Desk:
    """Posts tasks at random places of a square, and records when each is assigned.

    Args:
        wire: How it speaks to the hive.
        side: Of the square [m].

    Attributes:
        posted_again: How many times a task was posted again, because nobody had it for long.
    """

    def __init__(self, wire: Wire, side: float) -> None:
        self._wire = wire
        self._changed = threading.Condition()
        self._assigned: dict[str, float] = {}
        self._ended: set[str] = set()
        self._tasks: dict[str, Any] = {}
        self._draw = random.Random(1)
        self._side = side
        self._posted = 0
        self._waiting: set[str] = set()
        self.posted_again = 0
        wire.follow(self._hear)

    @property
    def is_heard(self) -> bool:
        """Whether the blackboard is connected in both directions."""
        return self._wire.is_heard

    def post(self, count: int = 1) -> list[str]:
        """Post some tasks; return their ids."""
        tasks = [self._make() for _ in range(count)]
        for task in tasks:
            self._tasks[task.id] = task
            self._wire.post(task)
        return [task.id for task in tasks]

    def wait(self, tasks: Iterable[str], patience: float = _PATIENCE) -> float:
        """Wait until all of these are assigned; return when the last one was [s, monotonic].

        Unassigned tasks are posted again now and then: without a leader nobody hears them.
        """
        wanted = set(tasks)
        end = time.monotonic() + patience
        with self._changed:
            while not self._changed.wait_for(lambda: wanted <= self._assigned.keys(), _REPEAT):
                missing = wanted - self._assigned.keys()
                if time.monotonic() > end:
                    raise LiveHiveError(
                        f"{len(missing)} of {len(wanted)} tasks not assigned in {patience:.0f} s"
                    )
                self.posted_again += len(missing)
                for task in missing:
                    known = "it waits" if task in self._waiting else "nothing was heard of it"
                    sys.stderr.write(f"{task} is posted again; {known}\n")
                    self._wire.post(self._tasks[task])
            return max(self._assigned[task] for task in wanted)

    def clear(self) -> None:
        """Cancel every task, again and again until it has ended."""
        end = time.monotonic() + _WHOLE_LIST
        while left := self._tasks.keys() - self._ended:
            if time.monotonic() > end:
                raise LiveHiveError(f"{len(left)} tasks not cancelled in {_WHOLE_LIST:.0f} s")
            for task in left:
                self._wire.cancel(task)
            with self._changed:
                self._changed.wait_for(lambda: self._tasks.keys() <= self._ended, _REPEAT)
        self._tasks.clear()

    def wait_for_fewer(self, tasks: Sequence[str], than: int) -> None:
        """Wait until fewer than so many of these tasks are unassigned."""
        with self._changed:
            self._changed.wait_for(
                lambda: sum(task not in self._assigned for task in tasks) < than, _PATIENCE
            )

    def _make(self) -> bb_msgs.TaskMsg:
        self._posted += 1
        goal = (self._draw.uniform(0.0, self._side), self._draw.uniform(0.0, self._side))
        return make_task(f"A{self._posted}", goal)

    def _hear(self, update: Any) -> None:  # noqa: ANN401  (a TaskState)
        now = time.monotonic()
        # A task posted again is answered with its current state.
        with self._changed:
            if update.state in {bb_msgs.TaskState.ASSIGNED, bb_msgs.TaskState.STARTED}:
                self._assigned.setdefault(update.task_id, now)
            elif update.state in TERMINAL:
                self._ended.add(update.task_id)
            else:
                self._waiting.add(update.task_id)
            self._changed.notify_all()
