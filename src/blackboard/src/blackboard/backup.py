# SPDX-License-Identifier: BSD-3-Clause
"""Who carries the blackboard, and the copy of the task list that everyone else holds.

The active blackboard says on `bb_backup` that it is there, and publishes the task list on
`bb_sync` with an epoch and a version, so that a reader can tell which of two copies is newer.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from blackboard.talker import BACKUP, SYNC

if TYPE_CHECKING:
    from blackboard.record import TaskRecord
    from blackboard.settings import BackupSettings
    from blackboard.talker import Talker, Timer


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """Who carries the blackboard (message BbBackup).

    Attributes:
        epoch: Grows with every new active blackboard.
        active: The member that carries it.
        backup: The member that stands first when the active one dies; empty when none can.
        members: All that may carry it, the active one included.
        progress: Grows with every turn of the active blackboard's own queue.
        heard: For each robot, the `RobotStatus.sent` of the last status that renews its lease [s].
        robot_lease: How long a robot may work from that time on [s], by its own clock.
    """

    epoch: int
    active: str
    backup: str = ""
    members: tuple[str, ...] = ()
    progress: int = 0
    heard: tuple[tuple[str, float], ...] = ()
    robot_lease: float = 0.0


@dataclass(frozen=True, slots=True)
class TaskList:
    """The task list (message BbSynch).

    Attributes:
        epoch: Of the blackboard that wrote it.
        version: Grows with every change within the epoch.
        records: Every task the hive knows, in the order they were posted.
    """

    epoch: int
    version: int
    records: tuple[TaskRecord, ...] = ()


class Backup:
    """Keeps the task list of the active blackboard, and lets everyone know both.

    Args:
        talker: How it speaks.
        member: Name of this member of the hive.
        settings: How often it speaks.
    """

    def __init__(self, talker: Talker, member: str, settings: BackupSettings) -> None:
        self._talker = talker
        self._member = member
        self._settings = settings
        self._records: dict[str, TaskRecord] = {}
        self._version = 0
        self._progress = 0
        self._sync: Timer | None = None
        self._heard: dict[str, float] = {}
        self._robot_lease = 0.0
        self.epoch = 1

    def start(self) -> None:
        """Begin to speak."""
        self._publish_sync()
        self._beat()
        self._talker.every(self._settings.heartbeat, self._beat)

    @property
    def records(self) -> tuple[TaskRecord, ...]:
        """Every task the hive knows, in the order they were posted."""
        return tuple(self._records.values())

    def get(self, task_id: str) -> TaskRecord | None:
        """Return what is known of a task, or None where it is unknown."""
        return self._records.get(task_id)

    def commit(self, record: TaskRecord) -> None:
        """Write down a new or changed record, and have it told to everyone."""
        self._records[record.task.id] = record
        self._version += 1
        self.tell()

    def tell(self) -> None:
        """Have the task list told to everyone within the sync period."""
        if self._sync is None:
            self._sync = self._talker.after(self._settings.sync_period, self._publish_sync)

    def grant(self, robot_id: str, sent: float, robot_lease: float) -> None:
        """Have a robot told with every heartbeat which of its statuses was heard last.

        Args:
            robot_id: Who is told.
            sent: When it sent the status, by its own clock [s].
            robot_lease: How long it may work from then on [s].
        """
        self._heard[robot_id] = sent
        self._robot_lease = robot_lease

    def _publish_sync(self) -> None:
        self._sync = None
        self._talker.publish(SYNC, TaskList(self.epoch, self._version, self.records))

    def _beat(self) -> None:
        self._progress += 1
        members = (self._member,)
        heard = tuple(self._heard.items())
        beat = Heartbeat(
            self.epoch, self._member, "", members, self._progress, heard, self._robot_lease
        )
        self._talker.publish(BACKUP, beat)
