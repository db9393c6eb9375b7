# SPDX-License-Identifier: BSD-3-Clause
"""Injects a schedule's faults into a simulated hive."""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from blackboard.consensus.member import Role, majority_of
from hive_lab.fault_schedules.faulty_network import Quality
from hive_lab.fault_schedules.schedule import (
    LEADER,
    BadLinks,
    Crash,
    Cut,
    Freeze,
    FullDisk,
    Loss,
    LyingDisk,
    PowerCut,
    RouterLoss,
    SlowDisk,
    Strike,
    Trigger,
    WritePoint,
)
from hive_lab.fault_schedules.zenoh_network import ZenohNetwork

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.consensus.journal import HardState
    from hive_lab.fault_schedules.faulty_network import FaultyNetwork, Host
    from hive_lab.fault_schedules.protocol_checker import ProtocolChecker
    from hive_lab.fault_schedules.simulated_member import Disk, SimulatedMember


class FaultInjector:
    """Injects the faults of one hive, and counts them by kind in `faults`."""

    def __init__(
        self,
        network: FaultyNetwork,
        members: Mapping[str, SimulatedMember],
        checker: ProtocolChecker,
    ) -> None:
        self._network = network
        self._members = members
        self._checker = checker
        self._bad_links: list[BadLinks] = []
        self._cuts: list[Cut] = []
        self._strikes: list[Strike] = []
        self._is_calm = False
        self.faults: Counter[str] = Counter()
        for member in members.values():
            member.disk.watched_by = partial(self._watch, member)

    def happen(self, fault: object) -> None:
        """Inject a fault."""
        self.faults[type(fault).__name__] += 1
        if isinstance(fault, Crash | Freeze | Loss | PowerCut):
            self._end_or_freeze(fault)
        elif isinstance(fault, Cut):
            self._cut_off(fault)
        elif isinstance(fault, BadLinks):
            self._bad_links.append(fault)
            self._network.quality = fault.quality
            self._network.schedule(fault.lasts, None, self._mend, fault)
        elif isinstance(fault, FullDisk | LyingDisk | SlowDisk):
            self._spoil(fault)
        elif isinstance(fault, RouterLoss) and isinstance(self._network, ZenohNetwork):
            self._network.lose_routers(fault.hang)
        elif isinstance(fault, Strike):
            self._strikes.append(fault)

    def _end_or_freeze(self, fault: Crash | Freeze | Loss | PowerCut) -> None:
        if isinstance(fault, Crash):
            self._crash(replace(fault, member=self._who(fault.member)))
        elif isinstance(fault, Freeze):
            self._freeze(replace(fault, member=self._who(fault.member)))
        elif isinstance(fault, Loss):
            for name in fault.members:
                self._stop_process(Crash(fault.at, name, None, disk_lost=True))
        else:
            for name in self._members:
                lasts = fault.lasts + self._network.random.uniform(0.0, 2.0)
                self._members[name].base.cancel()
                self._end(Crash(fault.at, name, lasts))

    def restart(self, name: str) -> None:
        """End a member's process, as a person does, and start it again after a moment."""
        self._stop_process(Crash(self._network.now, name, 1.0))

    def move_journal_away(self, name: str) -> None:
        """End a member's process, move its journal away and start it again, as a person does."""
        self._stop_process(Crash(self._network.now, name, 1.0, disk_lost=True))

    def boot(self, member: SimulatedMember) -> None:
        """Start a member, unless it runs or is gone."""
        if member.host.up or member.gone:
            return
        member.boot()
        if self._is_calm and member.drive is not None:
            member.drive.stalls = 0.0
        self._checker.after_event(member.host)

    def calm_down(self) -> None:
        """End all faults: links are good, and every member that is not gone comes back."""
        self._cuts.clear()
        self._bad_links.clear()
        self._strikes.clear()
        self._network.quality = Quality()
        self._apply_cuts(None)
        for member in self._members.values():
            member.disk.crashes = member.disk.full = False
            member.disk.takes = member.disk.lag = 0.0
            if member.host.frozen:
                self._thaw((member.host, member.host.generation))
            self.boot(member)
            if member.drive is not None:
                member.drive.stalls = 0.0
        self._is_calm = True

    def _who(self, name: str) -> str:
        if name != LEADER:
            return name
        leader = [
            (member.node.epoch, member.name)
            for member in self._members.values()
            if member.node is not None
            and member.host.up
            and member.node.member.role is Role.LEADER
        ]
        return max(leader)[1] if leader else self._network.random.choice(sorted(self._members))

    def _watch(
        self, member: SimulatedMember, before: HardState | None, after: HardState
    ) -> WritePoint:
        """Inject a strike that waited for a member's write; return when it hits."""
        if before is not None and before.member != after.member:
            self._checker.disk_given_up(before)
        for strike in self._strikes:
            if before is not None and strike.trigger in triggers(before, after):
                self._strikes.remove(strike)
                self.faults["struck"] += 1
                if isinstance(strike.fault, Cut) and strike.point is WritePoint.BEFORE_SAYING:
                    self._strike((strike.fault, member.name))
                    return WritePoint.AFTER
                self._network.schedule(0.0, None, self._strike, (strike.fault, member.name))
                return strike.point if isinstance(strike.fault, Crash) else WritePoint.AFTER
        return WritePoint.AFTER

    def _strike(self, what: tuple[Crash | Freeze | Cut, str]) -> None:
        fault, name = what
        if isinstance(fault, Crash):
            self._end(replace(fault, member=name))
        elif isinstance(fault, Freeze):
            self._freeze(replace(fault, member=name))
        else:
            self._cut_off(replace(fault, members=(name,)))

    def _spoil(self, fault: FullDisk | LyingDisk | SlowDisk) -> None:
        disk = self._members[self._who(fault.member)].disk
        if isinstance(fault, LyingDisk):
            disk.lag = fault.lag
        elif isinstance(fault, SlowDisk):
            disk.takes = fault.takes
            self._network.schedule(fault.lasts, None, self._speed_up, disk)
        else:
            disk.full = True
            self._network.schedule(fault.lasts, None, self._free, disk)

    def _free(self, disk: Disk) -> None:
        disk.full = False

    def _speed_up(self, disk: Disk) -> None:
        disk.takes = 0.0

    def _cut_off(self, cut: Cut) -> None:
        members = tuple(dict.fromkeys(map(self._who, cut.members)))
        others = tuple(name for name in map(self._who, cut.others) if name not in members)
        if cut.others and not others:
            others = (self._network.random.choice(sorted(set(self._members) - set(members))),)
        cut = replace(cut, members=members, others=others)
        self._cuts.append(cut)
        self._apply_cuts(None)
        self._network.schedule(cut.lasts, None, self._heal, cut)

    def _crash(self, crash: Crash) -> None:
        member = self._members[crash.member]
        if crash.while_writing and member.host.up:
            member.disk.crashes = True
            self._network.schedule(1.0, None, self._end_unless_crashed, crash)
        else:
            self._end(crash)

    def _end_unless_crashed(self, crash: Crash) -> None:
        """Crash now if no write came."""
        self._members[crash.member].disk.crashes = False
        self._end(crash)

    def _end(self, crash: Crash) -> None:
        member = self._members[crash.member]
        if crash.power:
            member.base.cancel()
        if (crash.back_after is None or crash.disk_lost) and self._would_lose_majority(member):
            crash = replace(crash, back_after=crash.back_after or 1.0, disk_lost=False)
        if crash.power and not self._survives_power_loss(member):
            crash = replace(crash, power=False)
        self._stop_process(crash)

    def _stop_process(self, crash: Crash) -> None:
        member = self._members[crash.member]
        if member.host.up:
            member.host.crash()
        self._checker.after_event(member.host)
        member.base.process_ended()
        self._stop(member)
        if member.disk.filled_up:
            self._checker.reports_lost(member.name)
        if crash.disk_lost:
            self.faults["disks lost"] += 1
            self._checker.disk_lost(member.name, member.disk.hard_state)
            member.disk.lose()
        if crash.power:
            self._lose_power(member)
        if crash.back_after is None:
            member.gone = True
        else:
            self._network.schedule(crash.back_after, None, self.boot, member)

    def _lose_power(self, member: SimulatedMember) -> None:
        """Lose what a member's disk only claims to have."""
        claimed = member.disk.hard_state
        if member.disk.lose_power():
            self.faults["writes lost"] += 1
            self._checker.disk_lost(member.name, claimed)

    def _stop(self, member: SimulatedMember) -> None:
        """Note that a robot no longer works, unless its base drives on."""
        if not member.base.drives:
            self._checker.stopped(member.name)

    def _would_lose_majority(self, lost: SimulatedMember) -> bool:
        """Return whether a majority needs this disk: the protocol does not survive its loss."""
        hard_state = lost.disk.hard_state
        if hard_state is None:
            return False
        disks = {
            each.disk.hard_state.member
            for each in self._members.values()
            if each.disk.hard_state is not None and not each.gone and each is not lost
        }
        for each in self._members.values():
            known = each.disk.hard_state
            if known is None or hard_state.member not in known.log.latest.members:
                continue
            for listed in (known.log.latest.members, known.log.stable.members):
                if sum(one in disks for one in listed) < majority_of(listed):
                    return True
        return False

    def _survives_power_loss(self, member: SimulatedMember) -> bool:
        """Return whether the protocol survives what a lying disk would lose now.

        No vote may be forgotten, and a majority has to keep what is committed.
        """
        claimed, kept = member.disk.hard_state, member.disk.after_power_loss
        if claimed is None or kept is None:
            return claimed is kept
        if (claimed.epoch, claimed.vote) != (kept.epoch, kept.vote):
            return False
        nodes = [each.node for each in self._members.values() if each.node is not None]
        logs = [node.member.log for node in nodes if node.hive == claimed.hive]
        newest = max([claimed.log, *logs], key=lambda log: log.committed)
        version, position = newest.committed, newest.at(newest.committed)
        disks = [each.disk.hard_state for each in self._members.values() if each is not member]
        holders = {
            each.member for each in (*disks, kept) if each and each.log.at(version) == position
        }
        lists = (newest.latest.members, newest.stable.members)
        return all(sum(one in holders for one in each) >= majority_of(each) for each in lists)

    def _freeze(self, freeze: Freeze) -> None:
        member = self._members[freeze.member]
        host = member.host
        if host.up and not host.frozen:
            host.frozen = True
            self._stop(member)
            self._network.schedule(freeze.lasts, None, self._thaw, (host, host.generation))

    def _thaw(self, what: tuple[Host, int]) -> None:
        host, generation = what
        if host.frozen and host.generation == generation:
            host.thaw()
            drive = self._members[host.name].drive
            if drive is not None and host.generation == generation:
                drive.go_on()

    def _heal(self, cut: Cut) -> None:
        if cut in self._cuts:
            self._cuts.remove(cut)
        self._apply_cuts(None)

    def _apply_cuts(self, _: object) -> None:
        self._network.cut.clear()
        self._network.holding.clear()
        for cut in self._cuts:
            everyone = self._network.hosts
            others = cut.others or [name for name in everyone if name not in cut.members]
            pairs = set(itertools.product(cut.members, others))
            if not cut.one_way:
                pairs |= {(there, here) for here, there in pairs}
            self._network.cut |= pairs
            if cut.holds:
                self._network.holding |= pairs
        self._network.release()

    def _mend(self, bad: BadLinks) -> None:
        if bad in self._bad_links:
            self._bad_links.remove(bad)
        worst = self._bad_links[-1].quality if self._bad_links else Quality()
        self._network.quality = worst


def triggers(before: HardState, after: HardState) -> set[Trigger]:
    """Return the turning points between two states on a member's disk."""
    found: set[Trigger] = set()
    if after.vote and after.vote != before.vote:
        found.add(Trigger.STANDS if after.vote == after.member else Trigger.VOTES)
    was, is_now = before.log.latest, after.log.latest
    if is_now.position != was.position:
        own = after.vote == after.member and is_now.position.epoch == after.epoch
        begins = own and was.position.epoch < after.epoch
        found.add(Trigger.TAKES_OVER if begins else Trigger.WRITES)
    if is_now.members != was.members:
        found.add(Trigger.CHANGES_MEMBERS)
    return found
