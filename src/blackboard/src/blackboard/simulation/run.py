# SPDX-License-Identifier: BSD-3-Clause
"""Runs schedules, and reports what came of them.

python3 -m blackboard.simulation.run 17            # prints schedule 17 and what comes of it
python3 -m blackboard.simulation.run 0 1000        # runs schedules 0 to 999
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from collections import Counter
from dataclasses import dataclass, field, replace
from random import Random
from typing import TYPE_CHECKING

from blackboard.member import majority_of
from blackboard.pose import Pose
from blackboard.simulation import hive as simulated
from blackboard.simulation.network import Network, Quality
from blackboard.simulation.properties import Properties, Violation
from blackboard.simulation.schedule import (
    SETTLE,
    TROUBLE,
    BadLinks,
    Cancel,
    Crash,
    Cut,
    Freeze,
    Post,
    PowerCut,
    Schedule,
    SetState,
    draw,
)
from blackboard.talker import NEW_TASK, TASK_CANCEL, TASK_STATE
from blackboard.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.record import TaskUpdate
    from blackboard.simulation.network import Host

CALM = 120.0
"""How long a hive has to finish everything after the trouble [s]."""

_REPEAT = 1.5
"""After this time an operator's program posts again what has not been taken in [s]."""

_SLOWEST, _FASTEST = 0.99, 1.01


@dataclass(frozen=True)
class Outcome:
    """What came of a schedule.

    Attributes:
        schedule: What was run.
        violation: The property that was broken; empty where none was.
        events: How many events happened.
        faults: How many of each kind happened, lost messages and the like included.
        takeovers: How often a member became active.
        ended: How many tasks ended in each state.
        lasted: Virtual time [s].
    """

    schedule: Schedule
    violation: str
    events: int
    faults: Counter[str]
    takeovers: int
    ended: Counter[str] = field(default_factory=Counter)
    lasted: float = 0.0


class Run:
    """One hive that goes through one schedule.

    Args:
        schedule: What happens to it.
    """

    def __init__(self, schedule: Schedule) -> None:
        self.schedule = schedule
        self.random = Random(schedule.seed)
        self.network = Network(self.random)
        self.members = {name: self._member(name) for name in schedule.members}
        tasks = [each.task for each in schedule.happenings if isinstance(each, Post)]
        self._posted = {task.id for task in tasks}
        self.properties = Properties(self.members, tasks, lambda: self.network.now)
        self.network.after_event = self._after_event
        self.network.said = self.properties.said
        self.faults: Counter[str] = Counter()
        self._bad_links: list[BadLinks] = []
        self._cuts: list[Cut] = []
        self._answered: set[str] = set()
        self._operator = self.network.add_host("operator")
        self._operator.up = True
        self._operator.handlers[TASK_STATE] = [self._hear]

    def _member(self, name: str) -> simulated.SimulatedMember:
        random = self.random
        host = self.network.add_host(name, random.uniform(_SLOWEST, _FASTEST))
        pose = Pose(random.uniform(0.0, 9.0), random.uniform(0.0, 9.0))
        return simulated.SimulatedMember(host, simulated.Disk(), pose, Random(random.random()))

    def run(self) -> Outcome:
        """Let it all happen; a broken property ends it."""
        for member in self.members.values():
            member.at_work = self.properties.at_work
            member.step_done = self.properties.step_done
            self.network.schedule(self.random.uniform(0.0, 1.0), None, self._boot, member)
        for happening in self.schedule.happenings:
            self.network.schedule(happening.at, None, self._happen, happening)
        end = SETTLE + TROUBLE
        violation = ""
        try:
            self.network.run(end)
            self._calm_down()
            self.network.run(end + CALM, self._is_over)
            self.properties.at_end()
        except Violation as broken:
            violation = str(broken)
        ended = Counter(record.state.name for record in self.properties.truth.values())
        return Outcome(
            self.schedule,
            violation,
            self.network.events,
            self.faults + self.network.counts,
            self.properties.takeovers,
            ended,
            self.network.now,
        )

    def _is_over(self) -> bool:
        truth = self.properties.truth
        return all(
            task_id in truth and truth[task_id].state.is_terminal for task_id in self._posted
        )

    def _after_event(self, host: object) -> None:
        if host is not self._operator:
            self.properties.after_event(host)  # type: ignore[arg-type]  # every other is a member's

    def _boot(self, member: simulated.SimulatedMember) -> None:
        if member.host.up or member.gone:
            return
        member.boot()
        self.properties.after_event(member.host)

    def _happen(self, happening: object) -> None:
        if isinstance(happening, Post):
            self._post(happening)
            return
        if isinstance(happening, Cancel):
            self.network.send(self._operator, TASK_CANCEL, happening.task)
            return
        self.faults[type(happening).__name__] += 1
        if isinstance(happening, SetState):
            self.network.send(self._operator, f"{happening.robot}/set_state", happening.word)
        elif isinstance(happening, Crash):
            self._crash(happening)
        elif isinstance(happening, PowerCut):
            for name in self.members:
                lasts = happening.lasts + self.random.uniform(0.0, 2.0)
                self._end(Crash(happening.at, name, lasts))
        elif isinstance(happening, Freeze):
            self._freeze(happening)
        elif isinstance(happening, Cut):
            self._cuts.append(happening)
            self._apply_cuts(None)
            self.network.schedule(happening.lasts, None, self._heal, happening)
        elif isinstance(happening, BadLinks):
            self._bad_links.append(happening)
            self.network.quality = happening.quality
            self.network.schedule(happening.lasts, None, self._mend, happening)

    def _post(self, post: Post) -> None:
        if post.task.id in self._answered:
            return
        self.network.send(self._operator, NEW_TASK, post.task)
        self.network.schedule(_REPEAT, None, self._post, post)

    def _hear(self, update: TaskUpdate) -> None:
        """Take the answer of the blackboard, whatever it is."""
        if not update.robot_id or update.state is not TaskState.WAITING:
            self._answered.add(update.task_id)

    def _crash(self, crash: Crash) -> None:
        member = self.members[crash.member]
        if crash.while_writing and member.host.up:
            member.disk.crashes = True
            self.network.schedule(1.0, None, self._end_unless_crashed, crash)
        else:
            self._end(crash)

    def _end_unless_crashed(self, crash: Crash) -> None:
        """Go on with a crash that was to happen at a write, whether there was one or not."""
        self.members[crash.member].disk.crashes = False
        self._end(crash)

    def _end(self, crash: Crash) -> None:
        member = self.members[crash.member]
        if (crash.back_after is None or crash.disk_lost) and self._would_lose_majority(member):
            crash = replace(crash, back_after=crash.back_after or 1.0, disk_lost=False)
        if member.host.up:
            member.host.crash()
        self.properties.after_event(member.host)
        self.properties.stopped(member.name)
        if crash.disk_lost:
            self.faults["disks lost"] += 1
            self.properties.disk_lost(member.name, member.disk.durable)
            member.disk.durable, member.disk.reports = None, ()
        if crash.back_after is None:
            member.gone = True
        else:
            self.network.schedule(crash.back_after, None, self._boot, member)

    def _would_lose_majority(self, lost: simulated.SimulatedMember) -> bool:
        """Return whether a disk is one that a majority needs: to lose it is not promised for."""
        durable = lost.disk.durable
        if durable is None:
            return False
        disks = {
            each.disk.durable.member
            for each in self.members.values()
            if each.disk.durable is not None and not each.gone and each is not lost
        }
        for each in self.members.values():
            known = each.disk.durable
            if known is None or durable.member not in known.log.latest.members:
                continue
            for listed in (known.log.latest.members, known.log.stable.members):
                if sum(one in disks for one in listed) < majority_of(listed):
                    return True
        return False

    def _freeze(self, freeze: Freeze) -> None:
        host = self.members[freeze.member].host
        if host.up and not host.frozen:
            host.frozen = True
            # A frozen host sends no velocities, so the base's own watchdog stops it.
            self.properties.stopped(freeze.member)
            self.network.schedule(freeze.lasts, None, self._thaw, (host, host.generation))

    def _thaw(self, what: tuple[Host, int]) -> None:
        host, generation = what
        if host.frozen and host.generation == generation:
            host.thaw()

    def _heal(self, cut: Cut) -> None:
        if cut in self._cuts:
            self._cuts.remove(cut)
        self._apply_cuts(None)

    def _apply_cuts(self, _: object) -> None:
        self.network.cut.clear()
        for cut in self._cuts:
            others = [name for name in self.network.hosts if name not in cut.members]
            pairs = set(itertools.product(cut.members, others))
            self.network.cut |= pairs
            if not cut.one_way:
                self.network.cut |= {(there, here) for here, there in pairs}

    def _mend(self, bad: BadLinks) -> None:
        if bad in self._bad_links:
            self._bad_links.remove(bad)
        worst = self._bad_links[-1].quality if self._bad_links else Quality()
        self.network.quality = worst

    def _calm_down(self) -> None:
        """End all trouble: links are good, who is not gone comes back, robots are in service."""
        self._cuts.clear()
        self._bad_links.clear()
        self.network.cut.clear()
        self.network.quality = Quality()
        for name, member in self.members.items():
            member.disk.crashes = False
            if member.host.frozen:
                member.host.thaw()
            self._boot(member)
            self.network.send(self._operator, f"{name}/set_state", "idle")


def run(schedule: Schedule) -> Outcome:
    """Run one schedule."""
    return Run(schedule).run()


def run_seeds(seeds: Iterable[int]) -> list[Outcome]:
    """Run the schedules of some seeds."""
    return [run(draw(seed)) for seed in seeds]


def main() -> None:
    """Run the schedules that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("first", type=int, help="seed of the first schedule")
    parser.add_argument(
        "end", type=int, nargs="?", help="seed after the last; only the first if left out"
    )
    wanted = parser.parse_args()
    if wanted.end is None:
        _show(run(draw(wanted.first)))
        return
    began = time.perf_counter()
    outcomes = run_seeds(range(wanted.first, wanted.end))
    took = time.perf_counter() - began
    bad = [outcome for outcome in outcomes if outcome.violation]
    for outcome in bad:
        sys.stdout.write(f"{outcome.schedule.seed}: {outcome.violation}\n")
    events = sum(outcome.events for outcome in outcomes)
    sys.stdout.write(f"{len(outcomes)} schedules, {len(bad)} violations\n")
    rates = len(outcomes) / took, events / took
    sys.stdout.write("{:.1f} schedules/s, {:.0f} events/s\n".format(*rates))
    total: Counter[str] = Counter()
    states: Counter[str] = Counter()
    for outcome in outcomes:
        total += outcome.faults
        states += outcome.ended
    lasted = sum(outcome.lasted for outcome in outcomes) / len(outcomes)
    sys.stdout.write(f"{dict(total)}\n{dict(states)}\nmean {lasted:.0f} s\n")


def _show(outcome: Outcome) -> None:
    sys.stdout.write(f"{outcome.schedule}\n\n{outcome.violation or 'every property holds'}\n")
    sys.stdout.write(
        f"{outcome.events} events in {outcome.lasted:.0f} s, {outcome.takeovers} takeovers, "
        f"tasks: {dict(outcome.ended)}\n"
    )


if __name__ == "__main__":
    main()
