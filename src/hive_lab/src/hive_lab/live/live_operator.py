# SPDX-License-Identifier: BSD-3-Clause
"""An operator's program for a real hive, which remembers what it hears.

Tests and benchmarks observe a hive with it, through the operator's topics and the heartbeats and
acknowledgements of the members.
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
from hive_common.machine_clock import machine_time
from hive_common.ros.links import mend_links
from hive_lab.runner.limits import PATIENCE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

ANSWERS = 13
"""Consecutive answers of each member, one to each heartbeat, until the hive counts as complete;
within that time a restarted member has sat out its election time and votes too.
"""

_REPEAT = 0.5  # time after which an unanswered task is posted again [s]
_LOOK_EVERY = 0.05  # a condition may be about more than what is heard [s]

TERMINAL = frozenset(
    {
        bb_msgs.TaskState.DONE,
        bb_msgs.TaskState.REJECTED,
        bb_msgs.TaskState.CANCELLED,
        bb_msgs.TaskState.FAILED,
    }
)


class LiveOperator:
    """Posts tasks to one hive, and keeps what it hears. Create it after `rospy.init_node`.

    Args:
        namespace: Of the hive, beginning and ending in a slash.
        members: Names of all its nodes.

    Attributes:
        last: The newest heartbeat of the highest epoch; None before the first.
        beats: Every heartbeat, with its arrival on the monotonic clock [s].
        updates: Every TaskState, by task id.
        robots: The last status of every robot.
        acknowledged: The version that each member has on disk, by its name.
        echoed: When the newest message was sent that each member has answered, by its name, on
            the monotonic clock [s].
        lives: The id of each member, which changes with its disk, by its name.

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
        self.echoed: dict[str, float] = {}
        self.lives: dict[str, str] = {}
        self._list: dict[str, Any] = {}
        self._list_version = (0, 0)
        self._listed: dict[str, set[int]] = defaultdict(set)
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
        """Close all subscriptions and publications."""
        for link in (*self._subscribers, self._new_task, self._cancel):
            link.unregister()

    def wait(self, condition: Callable[[], object], patience: float = PATIENCE) -> bool:
        """Wait until a condition holds; return whether it did in time [s]."""
        end = time.monotonic() + patience
        with self._changed:
            while not (holds := bool(condition())) and (left := end - time.monotonic()) > 0:
                self._changed.wait(min(left, _LOOK_EVERY))
        return holds

    def pass_time(self, seconds: float) -> None:
        """Let time pass [s]."""
        self.wait(lambda: False, seconds)

    def demand(
        self, condition: Callable[[], object], what: str, patience: float = PATIENCE
    ) -> None:
        """Wait until a condition holds [s]; LiveHiveError says `what` was expected in vain."""
        if not self.wait(condition, patience):
            raise LiveHiveError(f"not within {patience:.0f} s: {what}; last: {self.last}")

    def wait_until_whole(self) -> str:
        """Return the leader once every member votes and answers, and a backup is named."""
        self.demand(self.is_whole, f"{sorted(self._members)} are a complete hive")
        return str(self.last.active)

    def wait_until_up_to_date(self, since: float) -> None:
        """Wait until every member has answered a message sent since then [s, members' clock]."""

        def answered() -> bool:
            others = self._members - {self.last.active}
            return all(self.echoed.get(name, 0.0) > since for name in others)

        self.demand(answered, f"every member answers what was sent after {since:.1f}")

    def forget_answers(self) -> None:
        """Forget all answers so far, before a fault."""
        with self._changed:
            self._acks.clear()

    def wait_for_another(self, than: str, since: float) -> float:
        """Return the time from a fault to the first heartbeat of another leader [s].

        Both times are on the members' clock, which is the monotonic one of this machine.
        """

        def sent() -> list[float]:
            return [b.sent for _, b in self.beats if b.sent > since and b.active != than]

        self.demand(sent, f"another member takes over from {than}")
        return min(sent()) - since

    def post(self, task: bb_msgs.TaskMsg) -> Any:  # noqa: ANN401  (a TaskState)
        """Post a task until the blackboard answers; return the first answer.

        A robot that begins at once may be heard before the blackboard; that is no answer.
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
        """Cancel a task, again and again until it has ended."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            self._cancel.publish(task_id)
            if self.wait(lambda: self.state_of(task_id) in TERMINAL, _REPEAT):
                return
        raise LiveHiveError(f"{task_id} was not cancelled within {PATIENCE:.0f} s")

    def follow(self, task_id: str) -> int:
        """Wait for the end of a task; return its terminal state."""
        self.demand(
            lambda: self.state_of(task_id) in TERMINAL,
            f"{task_id} ends; so far: {self.updates[task_id][-3:]}",
        )
        return self.state_of(task_id)

    def state_of(self, task_id: str) -> int:
        """Return a task's state on the last published list; -1 if it is not there."""
        record = self._list.get(task_id)
        return -1 if record is None else int(record.state)

    def record_of(self, task_id: str) -> Any:  # noqa: ANN401  (a TaskRecord)
        """Return a task's record on the last published list, or None."""
        return self._list.get(task_id)

    def states_of(self, task_id: str) -> set[int]:
        """Return every published state of a task.

        A robot itself tells that it has begun. Who was not connected to that robot then learns it
        from the list.
        """
        return self._listed[task_id] | {update.state for update in self.updates[task_id]}

    def hears_all(self) -> bool:
        """Return whether it is connected to every member on every topic.

        rospy may lose a connection while a system starts, and restores it with the master's help.
        """
        most = len(self._members)
        return all(each.get_num_connections() >= most for each in self._subscribers)

    def is_whole(self) -> bool:
        """Return whether every member has a vote and answers, and a backup is named."""
        return self.all_answer() and set(self.last.members) >= self._members

    def all_answer(self) -> bool:
        """Return whether every member answers, voter or not, and a backup is named."""
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
            if ack.echo <= machine_time():  # Else it answers an odd message, not the leader's.
                self.echoed[name] = max(ack.echo, self.echoed.get(name, 0.0))
            same_epoch = self.last is not None and ack.epoch == self.last.epoch
            self._acks[name] = self._acks.get(name, 0) + 1 if same_epoch else 0
            self._changed.notify_all()

    def _hear_list(self, known: bb_msgs.BbSynch) -> None:
        """Take a list unless it is outdated: an earlier leader may be heard late."""
        with self._changed:
            version = (known.epoch, known.version)
            if version >= self._list_version:
                self._list_version = version
                self._list = {record.task.id: record for record in known.tasks}
                for name, record in self._list.items():
                    self._listed[name].add(int(record.state))
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
    """Return a handler that ignores messages of this node."""

    def hear_others(message: Any) -> None:  # noqa: ANN401  (any message)
        if message._connection_header["callerid"] != rospy.get_name():  # noqa: SLF001  (rospy's only way to tell)
            hear(message)

    return hear_others


def _is_report(update: bb_msgs.TaskState, active: str) -> bool:
    """Return whether an update is a robot's report rather than the leader's decision."""
    speaker: str = update._connection_header["callerid"]  # noqa: SLF001  (rospy's only way to tell)
    return speaker != active and speaker.endswith(f"/{update.robot_id}/robot")


def make_task(task_id: str, *goals: tuple[float, float], priority: int = 0) -> bb_msgs.TaskMsg:
    """Return a GA to one goal, or a GAB along several, x [m] and y [m]."""
    kind = bb_msgs.TaskMsg.GA if len(goals) == 1 else bb_msgs.TaskMsg.GAB
    header = Header(stamp=rospy.Time.now(), frame_id="map")
    poses = [Pose2D(x, y, 0.0) for x, y in goals]
    return bb_msgs.TaskMsg(header=header, id=task_id, type=kind, priority=priority, goals=poses)
