# SPDX-License-Identifier: BSD-3-Clause
"""Hives without tasks, whose members only keep each other company, for hours of virtual time."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random
from typing import TYPE_CHECKING

from blackboard.active import Heartbeat
from blackboard.backup import Backup
from blackboard.founding import founder
from blackboard.journal import Durable, MemoryJournal
from blackboard.replication import Log, Position, Whole
from blackboard.settings import BackupSettings
from blackboard.simulation.host import Host, HostTalker
from blackboard.simulation.network import Network, Quality

if TYPE_CHECKING:
    from blackboard.record import TaskRecord

_SLOWEST, _FASTEST = 0.99, 1.01


@dataclass(frozen=True)
class LongRun:
    """What came of it.

    Attributes:
        epochs: How many there were; the first is that of the founder.
        messages: How many were sent to somebody.
        lost: How many of them were lost.
    """

    epochs: int
    messages: int
    lost: int


class Company:
    """Members that hold a list and do nothing else.

    Args:
        members: How many, at least 1.
        seed: Of delays, losses and clocks.
        records: What is on the list from the start.
        quality: Of all links.

    Attributes:
        network: What they talk over, and the time.
        backups: By name.
        beats: Time [s] and epoch of every heartbeat that somebody sent.
    """

    def __init__(
        self,
        members: int,
        seed: int,
        records: tuple[TaskRecord, ...] = (),
        quality: Quality | None = None,
    ) -> None:
        random = Random(seed)
        self.network = Network(random)
        self.network.said = self._note
        self.backups: dict[str, Backup] = {}
        self.hosts: dict[str, Host] = {}
        self.beats: list[tuple[float, int]] = []
        for number in range(members):
            name = f"member{number}"
            self.hosts[name] = self.network.add_host(name, random.uniform(_SLOWEST, _FASTEST))
            disk = MemoryJournal(_first(f"{name}#1", records) if number == 0 else None)
            self._boot(name, disk, Random(random.random()))
        self.network.run(5.0)
        self.network.quality = quality or Quality()

    def _boot(self, name: str, disk: MemoryJournal, random: Random) -> None:
        host = self.hosts[name]
        host.boot()
        self.backups[name] = Backup(
            HostTalker(host), name, BackupSettings(), disk, random, founds=False
        )
        self.backups[name].start()

    def _note(self, _host: Host, _topic: str, message: object) -> None:
        if isinstance(message, Heartbeat):
            self.beats.append((self.network.now, message.epoch))


def _first(member: str, records: tuple[TaskRecord, ...]) -> Durable:
    empty = founder(member, "hive1")
    known = {record.task.id: record for record in records}
    whole = Whole(Position(1, 1), known, (member,))
    return Durable(member, empty.epoch, empty.vote, Log.of(whole), empty.hive)


def run_with_losses(hours: float, loss: float, seed: int, members: int = 3) -> LongRun:
    """Let a hive stand for hours over links that lose messages, and nobody crash.

    Args:
        hours: Virtual time [h].
        loss: Share of the messages that are lost.
        seed: Of all chances.
        members: How many there are.
    """
    company = Company(members, seed, quality=Quality(loss=loss))
    company.network.run(5.0 + 3600.0 * hours)
    epochs = {epoch for _, epoch in company.beats}
    counts = company.network.counts
    return LongRun(len(epochs), company.network.events, counts["lost"])
