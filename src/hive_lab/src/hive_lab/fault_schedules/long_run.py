# SPDX-License-Identifier: BSD-3-Clause
"""Hives without tasks that run for hours of virtual time."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

from blackboard.consensus.bootstrap import new_hive
from blackboard.consensus.journal import MemoryJournal
from blackboard.consensus.member import Role, has_lease
from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.node import RaftNode
from blackboard.domain.settings import RaftSettings
from hive_lab.fault_schedules.faulty_network import FaultyNetwork, Host, HostTalker, Quality

_SLOWEST, _FASTEST = 0.99, 1.01

_SETTLE = 10.0  # every member has a vote by then, and the leader knows the links [s]


@dataclass(frozen=True)
class LongRun:
    """The result.

    Attributes:
        takeovers: How often another member became leader, for each period.
        rivals: Heartbeats during which a second member could have acted as leader.
        lost: Number of lost messages.
        gaps: For each freeze, how long it took until another leader was heard [s].
    """

    takeovers: tuple[int, ...]
    rivals: int
    lost: int
    gaps: tuple[float, ...] = ()


class IdleHive:
    """Members that only replicate a log; each clock is up to 1 % wrong."""

    def __init__(self, members: int, seed: int) -> None:
        random = Random(seed)
        self.network = FaultyNetwork(random)
        self.network.said = self._note
        self._nodes: dict[str, RaftNode] = {}
        self._began: dict[int, float] = {}
        self.rivals = 0
        for number in range(members):
            name = f"member{number}"
            host = self.network.add_host(name, random.uniform(_SLOWEST, _FASTEST))
            disk = MemoryJournal(new_hive(f"{name}#1", "hive1") if number == 0 else None)
            host.boot()
            node = RaftNode(HostTalker(host), name, RaftSettings(), disk, Random(random.random()))
            self._nodes[name] = node
            node.start()
        self.network.run(_SETTLE)

    @property
    def epochs(self) -> int:
        """How many epochs there have been."""
        return len(self._began)

    def first_heard(self, number: int) -> float:
        """Return when the leader of an epoch, by its place in the order, was first heard [s]."""
        return list(self._began.values())[number]

    def freeze_leader(self, lasts: float) -> None:
        """Suspend the leader for a while [s]."""
        _, host = max(
            (self._nodes[host.name].epoch, host)
            for host in self.network.hosts.values()
            if self._nodes[host.name].member.role is Role.LEADER
        )
        host.frozen = True
        self.network.schedule(lasts, None, lambda _: host.thaw())

    def _note(self, speaker: Host, _topic: str, message: object) -> None:
        if not isinstance(message, Heartbeat):
            return
        self._began.setdefault(message.epoch, self.network.now)
        now = self.network.now
        able = (
            node.member.role is Role.LEADER
            and has_lease(node.member, now * self.network.hosts[name].rate)
            for name, node in self._nodes.items()
            if name != speaker.name
        )
        self.rivals += any(able)


def run_with_losses(hours: float, loss: float, seed: int, members: int = 3) -> LongRun:
    """Run a hive for hours [h] over links that lose a share of the messages; nobody crashes."""
    hive = IdleHive(members, seed)
    before = hive.epochs
    hive.network.quality = Quality(loss=loss)
    hive.network.run(_SETTLE + 3600.0 * hours)
    return LongRun((hive.epochs - before,), hive.rivals, hive.network.counts["lost"])


def run_with_freezes(
    count: int, lasts: float, seed: int, members: int = 3, apart: float = 20.0
) -> LongRun:
    """Suspend a hive's leader a number of times, each time for `lasts`, every `apart` [s]."""
    hive = IdleHive(members, seed)
    takeovers, gaps = [], []
    for number in range(count):
        before, frozen = hive.epochs, hive.network.now
        hive.freeze_leader(lasts)
        hive.network.run(_SETTLE + (number + 1) * apart)
        takeovers.append(hive.epochs - before)
        gaps += [hive.first_heard(before) - frozen] if hive.epochs > before else []
    return LongRun(tuple(takeovers), hive.rivals, hive.network.counts["lost"], tuple(gaps))
