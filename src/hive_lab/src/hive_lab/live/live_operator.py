# SPDX-License-Identifier: BSD-3-Clause
"""A program that speaks the operator's contract with a real hive, and remembers what it hears.

Tests and benchmarks that break a hive look at it from here: through the topics that every
operator's program can use, and the heartbeat and acknowledgements of its members.
"""

from __future__ import annotations

import threading
import time
from collections import defaultdict
from typing import TYPE_CHECKING, Any

import blackboard.msg as bb_msgs
import rospy
from geometry_msgs.msg import Pose2D
from std_msgs.msg import Header, String

from blackboard.errors import LiveHiveError
from hive_common.ros.links import mend_links

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

PATIENCE = 60.0
"""Wall time that a busy machine may take for anything [s]."""

ANSWERS = 13
"""Answers of each member in a row, one to each heartbeat, until the hive counts as whole; within
that time one that was started again has sat out its election time and votes too."""

_REPEAT = 0.5
"""Time after which a task that nobody has answered is posted again [s]."""

TERMINAL = frozenset(
    {
        bb_msgs.TaskState.DONE,
        bb_msgs.TaskState.REJECTED,
        bb_msgs.TaskState.CANCELLED,
        bb_msgs.TaskState.FAILED,
    }
)


class LiveOperator:
    """Posts tasks to one hive, and keeps what was said on its topics.

    Make it after `rospy.init_node`.

    Args:
        namespace: Of the hive, beginning and ending in a slash.
        members: Names of all its nodes.

    Attributes:
        last: The newest heartbeat of the highest epoch; None before the first.
        beats: Every heartbeat heard, with the time on the monotonic clock [s].
        updates: Every TaskState heard, by task id.
        robots: The last status of every robot.
        acknowledged: Up to which version each member has the list on disk, by its name.
        lives: The id of each member, which names the life of its disk, by its name.

    ROS Subscribers: `bb_backup`, `bb_ack`, `bb_sync`, `task_state`, `robot_status`.
    ROS Publishers: `new_task`, `task_cancel`.
    """

    def __init__(self, namespace: str, members: Iterable[str]) -> None:
        self._members = frozenset(members)
        self._changed = threading.Condition()
        self._acks: dict[str, int] = {}
        self.last: Any = None
        self.beats: list[tuple[float, Any]] = []
        self.updates: dict[str, list[Any]] = defaultdict(list)
        self.robots: dict[str, Any] = {}
        self.acknowledged: dict[str, int] = {}
        self.lives: dict[str, str] = {}
        self._list: dict[str, Any] = {}
        self._list_version = (0, 0)
        self._new_task = rospy.Publisher(f"{namespace}new_task", bb_msgs.TaskMsg, queue_size=1000)
        self._cancel = rospy.Publisher(f"{namespace}task_cancel", String, queue_size=1000)
        listens = (
            ("bb_backup", bb_msgs.BbBackup, self._hear_beat),
            ("bb_ack", bb_msgs.BbAck, self._hear_ack),
            ("bb_sync", bb_msgs.BbSynch, self._hear_list),
            ("task_state", bb_msgs.TaskState, self._hear_update),
            ("robot_status", bb_msgs.RobotStatus, self._hear_robot),
        )
        self._subscribers = [
            rospy.Subscriber(namespace + topic, kind, _unless_own(hear))
            for topic, kind, hear in listens
        ]
        mend_links()

    def close(self) -> None:
        """Hear no more, and be heard no more."""
        for link in (*self._subscribers, self._new_task, self._cancel):
            link.unregister()

    def wait(self, condition: Callable[[], object], patience: float = PATIENCE) -> bool:
        """Wait until something is so; return whether it became so in time [s]."""
        with self._changed:
            return bool(self._changed.wait_for(condition, patience))

    def pass_time(self, seconds: float) -> None:
        """Let time pass while messages are taken in [s]."""
        self.wait(lambda: False, seconds)

    def demand(
        self, condition: Callable[[], object], what: str, patience: float = PATIENCE
    ) -> None:
        """Wait until something is so.

        Raises:
            LiveHiveError: It did not become so in time [s]; the text says what was waited for.
        """
        if not self.wait(condition, patience):
            raise LiveHiveError(f"not within {patience:.0f} s: {what}; last: {self.last}")

    def wait_until_whole(self) -> str:
        """Return who is active once every member has a vote, answers, and a backup is named."""
        self.demand(self.is_whole, f"{sorted(self._members)} make a whole hive")
        return str(self.last.active)

    def forget_answers(self) -> None:
        """Forget who has answered so far: something happens to the hive."""
        with self._changed:
            self._acks.clear()

    def wait_for_another(self, than: str, since: float) -> float:
        """Return after how long another active member sent its first heartbeat [s].

        All members are on this machine, and so on its monotonic clock.

        Args:
            than: Name of the one before.
            since: When it was broken, on the monotonic clock [s].
        """

        def sent() -> list[float]:
            return [b.sent for _, b in self.beats if b.sent > since and b.active != than]

        self.demand(sent, f"somebody takes over from {than}")
        return min(sent()) - since

    def post(self, task: bb_msgs.TaskMsg) -> Any:  # noqa: ANN401  (a TaskState)
        """Post a task until somebody answers; return the first answer.

        A robot that has begun it at once may be heard before the blackboard that took it in.
        """
        known = len(self.updates[task.id])

        def answers() -> list[Any]:
            active = self.last.active if self.last else ""
            return [u for u in self.updates[task.id][known:] if not _is_report(u, active)]

        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            self._new_task.publish(task)
            if self.wait(answers, _REPEAT):
                return answers()[0]
        raise LiveHiveError(f"nobody answered {task.id} within {PATIENCE:.0f} s")

    def post_once(self, task: bb_msgs.TaskMsg) -> None:
        """Post a task and do not wait."""
        self._new_task.publish(task)

    def cancel(self, task_id: str) -> None:
        """Take a task off the list, and say so until it is."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            self._cancel.publish(task_id)
            if self.wait(lambda: self.state_of(task_id) in TERMINAL, _REPEAT):
                return
        raise LiveHiveError(f"{task_id} was not cancelled within {PATIENCE:.0f} s")

    def follow(self, task_id: str) -> int:
        """Wait for the end of a task; return the state in which it ended."""
        self.demand(
            lambda: self.state_of(task_id) in TERMINAL,
            f"{task_id} ends; so far: {self.updates[task_id][-3:]}",
        )
        return self.state_of(task_id)

    def state_of(self, task_id: str) -> int:
        """Return the last state of a task on the list as published; -1 where it is not there."""
        record = self._list.get(task_id)
        return -1 if record is None else int(record.state)

    def record_of(self, task_id: str) -> Any:  # noqa: ANN401  (a TaskRecord)
        """Return a task's record on the list as published last, or None."""
        return self._list.get(task_id)

    def states_of(self, task_id: str) -> set[int]:
        """Return every state that was told of a task."""
        return {update.state for update in self.updates[task_id]}

    def is_whole(self) -> bool:
        """Return whether every member has a vote and answers, and a backup is named."""
        return self.all_answer() and set(self.last.members) >= self._members

    def all_answer(self) -> bool:
        """Return whether every member answers, with a vote or without, and a backup is named."""
        if self.last is None or not self.last.backup:
            return False
        others = self._members - {self.last.active}
        return all(self._acks.get(name, 0) >= ANSWERS for name in others)

    def _hear_beat(self, beat: bb_msgs.BbBackup) -> None:
        with self._changed:
            self.beats.append((time.monotonic(), beat))
            if self.last is None or beat.epoch >= self.last.epoch:
                self.last = beat
            self._changed.notify_all()

    def _hear_ack(self, ack: bb_msgs.BbAck) -> None:
        with self._changed:
            name = ack.member.partition("#")[0]
            self.acknowledged[name], self.lives[name] = ack.version, ack.member
            same_epoch = self.last is not None and ack.epoch == self.last.epoch
            self._acks[name] = self._acks.get(name, 0) + 1 if same_epoch else 0
            self._changed.notify_all()

    def _hear_list(self, known: bb_msgs.BbSynch) -> None:
        """Take in a list, unless one is known that is newer: an earlier boss may be heard late."""
        with self._changed:
            version = (known.epoch, known.version)
            if version >= self._list_version:
                self._list_version = version
                self._list = {record.task.id: record for record in known.tasks}
                self._changed.notify_all()

    def _hear_update(self, update: bb_msgs.TaskState) -> None:
        with self._changed:
            self.updates[update.task_id].append(update)
            self._changed.notify_all()

    def _hear_robot(self, status: bb_msgs.RobotStatus) -> None:
        with self._changed:
            self.robots[status.robot_id] = status
            self._changed.notify_all()


def _unless_own(hear: Callable[[Any], None]) -> Callable[[Any], None]:
    """Return what hears only others: a test that speaks nonsense must not believe itself."""

    def hear_others(message: Any) -> None:  # noqa: ANN401  (any message)
        if message._connection_header["callerid"] != rospy.get_name():  # noqa: SLF001  (rospy's only way to tell)
            hear(message)

    return hear_others


def _is_report(update: bb_msgs.TaskState, active: str) -> bool:
    """Return whether a robot says how far it is, and not the active blackboard what it decided."""
    speaker: str = update._connection_header["callerid"]  # noqa: SLF001  (rospy's only way to tell)
    return speaker != active and speaker.endswith(f"/{update.robot_id}/robot")


def make_task(task_id: str, *goals: tuple[float, float], priority: int = 0) -> bb_msgs.TaskMsg:
    """Return a GA to the one goal, or a GAB along the goals, x [m] and y [m]."""
    kind = bb_msgs.TaskMsg.GA if len(goals) == 1 else bb_msgs.TaskMsg.GAB
    header = Header(stamp=rospy.Time.now(), frame_id="map")
    poses = [Pose2D(x, y, 0.0) for x, y in goals]
    return bb_msgs.TaskMsg(header=header, id=task_id, type=kind, priority=priority, goals=poses)
