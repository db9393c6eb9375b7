# SPDX-License-Identifier: BSD-3-Clause
"""Runs fault schedules, and reports their results.

python3 -m hive_lab.fault_schedules.run 17       # prints schedule 17 and its result
python3 -m hive_lab.fault_schedules.run 0 1000   # runs schedules 0 to 999
python3 -m hive_lab.fault_schedules.run 17 --scenario "lost disks"   # in one scenario
python3 -m hive_lab.fault_schedules.run rivals   # a schedule written by hand
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import dataclass, field
from random import Random
from typing import TYPE_CHECKING

from blackboard.domain.talker import TASK_CANCEL
from hive_common.pose import Pose
from hive_lab.fault_schedules.directed import DIRECTED
from hive_lab.fault_schedules.directed_over_zenoh import OVER_ZENOH
from hive_lab.fault_schedules.draw import draw
from hive_lab.fault_schedules.drawn_links import ROS, TRANSPORTS, ZENOH
from hive_lab.fault_schedules.faulty_network import FaultyNetwork
from hive_lab.fault_schedules.harness import Harness
from hive_lab.fault_schedules.history import Violation
from hive_lab.fault_schedules.rescue import Rescuer
from hive_lab.fault_schedules.scenarios import ASIDE, SCENARIOS
from hive_lab.fault_schedules.schedule import (
    BY_HAND,
    FAULT_PERIOD,
    SETTLE,
    Cancel,
    Post,
    Recover,
    SetState,
)
from hive_lab.fault_schedules.simulated_member import Disk, SimulatedMember
from hive_lab.fault_schedules.zenoh_network import ZenohNetwork

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hive_lab.fault_schedules.schedule import FaultSchedule

CALM = 300.0  # how long a hive has to finish everything after the last fault [s]
_ROUNDS = 30.0  # in the calm an operator puts robots back into service this often [s]
_SLOWEST, _FASTEST = 0.99, 1.01


@dataclass(frozen=True)
class RunResult:
    """The result of a schedule.

    Attributes:
        violation: The property that broke; empty if none did.
        events: How many events happened.
        faults: Faults by kind, lost messages and the like included.
        takeovers: How often a member became leader.
        ended: Tasks by terminal state.
        lasted: Virtual time [s].
        exercised: How often each of `FEATURES` happened.
    """

    schedule: FaultSchedule
    violation: str
    events: int
    faults: Counter[str]
    takeovers: int
    ended: Counter[str] = field(default_factory=Counter)
    lasted: float = 0.0
    exercised: Counter[str] = field(default_factory=Counter)

    def in_full(self) -> str:
        """Return the schedule, what broke, and how to run it again."""
        schedule = self.schedule
        if schedule.scenario == BY_HAND:
            again = "see the test that defines it"
        elif schedule.scenario in DIRECTED:
            again = f'python3 -m hive_lab.fault_schedules.run "{schedule.scenario}"'
        else:
            again = f"python3 -m hive_lab.fault_schedules.run {schedule.seed}"
            is_default = draw(schedule.seed, zenoh=schedule.site is not None) == schedule
            again += "" if is_default else f' --scenario "{schedule.scenario}"'
        if schedule.site is not None and schedule.scenario != BY_HAND:
            again += " --transport zenoh"
        broken = self.violation or "every property holds"
        return f"{schedule}\n\n{broken}\nto run it again: {again}\n"


class Run(Harness):
    """One hive that goes through one schedule."""

    def __init__(self, schedule: FaultSchedule) -> None:
        super().__init__(_network(schedule))
        self.exercised.drawn(schedule.board, schedule.kits, len(schedule.aside))
        self.schedule = schedule
        members = {name: self._member(name) for name in schedule.members}
        tasks = [each.task for each in schedule.happenings if isinstance(each, Post)]
        self.connect(members, tasks)
        self._rescuer = Rescuer(self, {task.id: task for task in tasks})

    def _member(self, name: str) -> SimulatedMember:
        random = self.random
        rate = random.uniform(_SLOWEST, _FASTEST)
        if self.schedule.far_clocks:
            rate = _SLOWEST if rate < 1.0 else _FASTEST
        host = self.network.add_host(name, rate)
        pose = Pose(random.uniform(0.0, 9.0), random.uniform(0.0, 9.0))
        own = Random(random.random())
        settings, board = self.schedule.settings, self.schedule.board
        voter = name not in self.schedule.aside
        kit = self.schedule.kit_of(name)
        return SimulatedMember(host, Disk(), pose, own, settings, board, voter=voter, kit=kit)

    def run(self) -> RunResult:
        """Run the schedule; a violation ends it."""
        self.start(self.members.values(), dict(self.schedule.late))
        for happening in self.schedule.happenings:
            self.network.schedule(happening.at, None, self._happen, happening)
        end = SETTLE + FAULT_PERIOD
        violation = ""
        ending = self.checker.ending
        try:
            self.network.run(end)
            self.injector.calm_down()
            self._set_all_idle(None)
            self._rescuer.end_other_hives()
            if self.schedule.scenario not in {BY_HAND, *DIRECTED}:
                self._rescuer.watch()
            self.network.run(end + CALM, ending.is_over)
            ending.check()
        except Violation as broken:
            violation = str(broken)
        ended = Counter(record.state.name for record in ending.truth.values())
        return RunResult(
            self.schedule,
            violation,
            self.network.events,
            self.injector.faults + self.network.counts,
            self.checker.takeovers,
            +ended,
            self.network.now,
            +self.exercised.counts,
        )

    def _set_all_idle(self, _: object) -> None:
        """Put every robot back into service, as a person does who has taken its load off."""
        for name in self.members:
            self.network.send(self.operator, f"{name}/set_state", "idle")
        self.network.schedule(_ROUNDS, None, self._set_all_idle, None)

    def _happen(self, happening: object) -> None:
        if isinstance(happening, Post):
            post = self.post_anew if happening.anew else self.post
            post(happening.task)
        elif isinstance(happening, Cancel):
            self.network.send(self.operator, TASK_CANCEL, happening.task)
        elif isinstance(happening, SetState):
            self.injector.faults["SetState"] += 1
            self.network.send(self.operator, f"{happening.robot}/set_state", happening.word)
        elif isinstance(happening, Recover):
            self._rescuer.recover_with(happening.member)
        else:
            self.injector.happen(happening)


def _network(schedule: FaultSchedule) -> FaultyNetwork:
    random = Random(schedule.seed)
    if schedule.site is None:
        return FaultyNetwork(random, schedule.proofs)
    return ZenohNetwork(random, schedule.proofs, schedule.site)


def run(schedule: FaultSchedule) -> RunResult:
    """Run one schedule."""
    return Run(schedule).run()


def main() -> None:
    """Run the schedules that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    names = ", ".join(DIRECTED)
    parser.add_argument("first", help=f"seed of the first schedule, or one of: {names}")
    parser.add_argument(
        "end", type=int, nargs="?", help="seed after the last; by default only one runs"
    )
    parser.add_argument(
        "--scenario", "--mood", choices=[*SCENARIOS, *ASIDE], default="", help="by default drawn"
    )
    parser.add_argument(
        "--transport", choices=TRANSPORTS, default=ROS, help="what carries the messages"
    )
    wanted = parser.parse_args()
    zenoh = wanted.transport == ZENOH
    schedules: Iterable[FaultSchedule]
    by_hand = OVER_ZENOH if zenoh else DIRECTED
    if wanted.first in by_hand:
        schedules = [by_hand[wanted.first]]
    elif wanted.first.isdecimal():
        first = int(wanted.first)
        end = first + 1 if wanted.end is None else wanted.end
        schedules = (draw(seed, wanted.scenario, zenoh=zenoh) for seed in range(first, end))
    else:
        parser.error(f"no schedule is called {wanted.first!r}; allowed: a seed, {names}")
    total: Counter[str] = Counter()
    for outcome in map(run, schedules):
        total.update(schedules=1, violations=bool(outcome.violation), events=outcome.events)
        total.update(takeovers=outcome.takeovers, **outcome.ended)
        total.update(outcome.faults)
        if outcome.violation or wanted.end is None:
            sys.stdout.write(outcome.in_full())
    sys.stdout.write(", ".join(f"{count} {name}" for name, count in total.items()) + "\n")


if __name__ == "__main__":
    main()
