# SPDX-License-Identifier: BSD-3-Clause
"""Hives without tasks, whose members only keep each other company, for hours of virtual time."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

from blackboard.consensus.bootstrap import founder
from blackboard.consensus.journal import MemoryJournal
from blackboard.consensus.member import Role, has_lease
from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.node import RaftNode
from blackboard.domain.settings import RaftSettings
from hive_lab.fault_schedules.faulty_network import FaultyNetwork, Host, HostTalker, Quality

_SLOWEST, _FASTEST = 0.99, 1.01

_SETTLE = 5.0
"""By then every member has a vote [s]."""


@dataclass(frozen=True)
class LongRun:
    """What came of it.

    Attributes:
        takeovers: How often another member became active, for each thing that was done to them.
        rivals: Heartbeats during which a second member could have acted.
        lost: How many messages were lost.
    """

    takeovers: tuple[int, ...]
    rivals: int
    lost: int


class Company:
    """Members that do nothing but keep a list; each has a clock of its own, up to 1 % wrong.

    Args:
        members: How many, at least 1.
        seed: Of delays, losses and clocks.
    """

    def __init__(self, members: int, seed: int) -> None:
        random = Random(seed)
        self.network = FaultyNetwork(random)
        self.network.said = self._note
        self._backups: dict[str, RaftNode] = {}
        self._epochs: set[int] = set()
        self.rivals = 0
        for number in range(members):
            name = f"member{number}"
            host = self.network.add_host(name, random.uniform(_SLOWEST, _FASTEST))
            disk = MemoryJournal(founder(f"{name}#1", "hive1") if number == 0 else None)
            host.boot()
            backup = RaftNode(
                HostTalker(host), name, RaftSettings(), disk, Random(random.random())
            )
            self._backups[name] = backup
            backup.start()
        self.network.run(_SETTLE)

    @property
    def epochs(self) -> int:
        """How many there have been."""
        return len(self._epochs)

    def freeze_leader(self, lasts: float) -> None:
        """Stop the active one for a while [s]."""
        _, host = max(
            (self._backups[host.name].epoch, host)
            for host in self.network.hosts.values()
            if self._backups[host.name].member.role is Role.LEADER
        )
        host.frozen = True
        self.network.schedule(lasts, None, lambda _: host.thaw())

    def _note(self, speaker: Host, _topic: str, message: object) -> None:
        if not isinstance(message, Heartbeat):
            return
        self._epochs.add(message.epoch)
        now = self.network.now
        able = (
            backup.member.role is Role.LEADER
            and has_lease(backup.member, now * self.network.hosts[name].rate)
            for name, backup in self._backups.items()
            if name != speaker.name
        )
        self.rivals += any(able)


def run_with_losses(hours: float, loss: float, seed: int, members: int = 3) -> LongRun:
    """Let a hive stand for hours over links that lose messages, and nobody crash.

    Args:
        hours: Virtual time [h].
        loss: Share of the messages that are lost.
        seed: Of all chances.
        members: How many there are.
    """
    company = Company(members, seed)
    before = company.epochs
    company.network.quality = Quality(loss=loss)
    company.network.run(_SETTLE + 3600.0 * hours)
    return LongRun((company.epochs - before,), company.rivals, company.network.counts["lost"])


def run_with_freezes(
    count: int, lasts: float, seed: int, members: int = 3, apart: float = 20.0
) -> LongRun:
    """Stop the active one of a hive for a while, again and again.

    Args:
        count: How often.
        lasts: For how long each time [s].
        seed: Of all chances.
        members: How many there are.
        apart: Time from one to the next [s].
    """
    company = Company(members, seed)
    takeovers = []
    for number in range(count):
        before = company.epochs
        company.freeze_leader(lasts)
        company.network.run(_SETTLE + (number + 1) * apart)
        takeovers.append(company.epochs - before)
    return LongRun(tuple(takeovers), company.rivals, company.network.counts["lost"])
