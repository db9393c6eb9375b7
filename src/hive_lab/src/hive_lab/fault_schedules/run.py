# SPDX-License-Identifier: BSD-3-Clause
"""Runs schedules, and reports what came of them.

python3 -m hive_lab.fault_schedules.run 17                      # prints schedule 17, and its outcome
python3 -m hive_lab.fault_schedules.run 0 1000                  # runs schedules 0 to 999
python3 -m hive_lab.fault_schedules.run 17 --mood "lost disks"  # the same in one mood
python3 -m hive_lab.fault_schedules.run rivals                  # one that was written by hand
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import dataclass, field
from random import Random
from typing import TYPE_CHECKING

from blackboard.domain.talker import NEW_TASK, TASK_CANCEL, TASK_STATE
from blackboard.domain.task import TaskState
from hive_common.pose import Pose
from hive_lab.fault_schedules import simulated_member as simulated
from hive_lab.fault_schedules.directed import DIRECTED
from hive_lab.fault_schedules.draw import draw
from hive_lab.fault_schedules.faulty_network import FaultyNetwork
from hive_lab.fault_schedules.history import Violation
from hive_lab.fault_schedules.injector import FaultInjector
from hive_lab.fault_schedules.protocol_checker import ProtocolChecker
from hive_lab.fault_schedules.scenarios import SCENARIOS
from hive_lab.fault_schedules.schedule import (
    BY_HAND,
    FAULT_PERIOD,
    OPERATOR,
    SETTLE,
    Cancel,
    Post,
    SetState,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.domain.record import TaskUpdate
    from hive_lab.fault_schedules.schedule import FaultSchedule

CALM = 120.0
"""How long a hive has to finish everything after the trouble [s]."""

_REPEAT = 1.5
"""After this time an operator's program posts again what has not been taken in [s]."""

_SLOWEST, _FASTEST = 0.99, 1.01


@dataclass(frozen=True)
class RunResult:
    """What came of a schedule.

    Attributes:
        schedule: What was run.
        violation: The property that was broken; empty where none was.
        events: How many events happened.
        faults: How many of each kind happened, lost messages and the like included.
        takeovers: How often a member became active.
        ended: How many tasks ended in each state, and how many are left behind in a hive that
            gives way to another and waits for a person.
        lasted: Virtual time [s].
    """

    schedule: FaultSchedule
    violation: str
    events: int
    faults: Counter[str]
    takeovers: int
    ended: Counter[str] = field(default_factory=Counter)
    lasted: float = 0.0

    def in_full(self) -> str:
        """Return the schedule, what broke, and how to run it again, for a person."""
        schedule = self.schedule
        if schedule.scenario == BY_HAND:
            again = "it is written in the test"
        elif schedule.scenario in DIRECTED:
            again = f'python3 -m hive_lab.fault_schedules.run "{schedule.scenario}"'
        else:
            again = f"python3 -m hive_lab.fault_schedules.run {schedule.seed}"
            again += "" if draw(schedule.seed) == schedule else f' --mood "{schedule.scenario}"'
        broken = self.violation or "every property holds"
        return f"{schedule}\n\n{broken}\nto see it again: {again}\n"


class Run:
    """One hive that goes through one schedule.

    Args:
        schedule: What happens to it.
    """

    def __init__(self, schedule: FaultSchedule) -> None:
        self.schedule = schedule
        self.random = Random(schedule.seed)
        self.network = FaultyNetwork(self.random, schedule.proofs)
        self.members = {name: self._member(name) for name in schedule.members}
        tasks = [each.task for each in schedule.happenings if isinstance(each, Post)]
        self.properties = ProtocolChecker(self.members, tasks, lambda: self.network.now)
        self.network.after_event = self.properties.after_event
        self.network.said = self.properties.said
        self.injector = FaultInjector(self.network, self.members, self.properties)
        self._answered: set[str] = set()
        self._operator = self.network.add_host(OPERATOR)
        self._operator.up = True
        self._operator.handlers[TASK_STATE] = [self._hear]

    def _member(self, name: str) -> simulated.SimulatedMember:
        random = self.random
        rate = random.uniform(_SLOWEST, _FASTEST)
        if self.schedule.far_clocks:
            rate = _SLOWEST if rate < 1.0 else _FASTEST
        host = self.network.add_host(name, rate)
        pose = Pose(random.uniform(0.0, 9.0), random.uniform(0.0, 9.0))
        own = Random(random.random())
        settings, patience = self.schedule.settings, self.schedule.patience
        disk, voter = simulated.Disk(), name not in self.schedule.aside
        return simulated.SimulatedMember(host, disk, pose, own, settings, patience, voter=voter)

    def run(self) -> RunResult:
        """Let it all happen; a broken property ends it."""
        late = dict(self.schedule.late)
        for name, member in self.members.items():
            member.at_work = self.properties.at_work
            member.step_done = self.properties.step_done
            start = late.get(name, self.random.uniform(0.0, 1.0))
            self.network.schedule(start, None, self.injector.boot, member)
        for happening in self.schedule.happenings:
            self.network.schedule(happening.at, None, self._happen, happening)
        end = SETTLE + FAULT_PERIOD
        violation = ""
        try:
            self.network.run(end)
            self.injector.calm_down()
            for name in self.members:
                self.network.send(self._operator, f"{name}/set_state", "idle")
            self.network.run(end + CALM, self.properties.ending.is_over)
            self.properties.ending.check()
        except Violation as broken:
            violation = str(broken)
        ended = Counter(record.state.name for record in self.properties.ending.truth.values())
        ended["left behind"] = len(self.properties.ending.left_behind())
        return RunResult(
            self.schedule,
            violation,
            self.network.events,
            self.injector.faults + self.network.counts,
            self.properties.takeovers,
            +ended,
            self.network.now,
        )

    def _happen(self, happening: object) -> None:
        if isinstance(happening, Post):
            if happening.anew:
                self._answered.discard(happening.task.id)
            self._post(happening)
        elif isinstance(happening, Cancel):
            self.network.send(self._operator, TASK_CANCEL, happening.task)
        elif isinstance(happening, SetState):
            self.injector.faults["SetState"] += 1
            self.network.send(self._operator, f"{happening.robot}/set_state", happening.word)
        else:
            self.injector.happen(happening)

    def _post(self, post: Post) -> None:
        if post.task.id in self._answered:
            return
        self.network.send(self._operator, NEW_TASK, post.task)
        self.network.schedule(_REPEAT, None, self._post, post)

    def _hear(self, update: TaskUpdate) -> None:
        """Take the answer of the blackboard, whatever it is."""
        if not update.robot_id or update.state is not TaskState.WAITING:
            self._answered.add(update.task_id)


def run(schedule: FaultSchedule) -> RunResult:
    """Run one schedule."""
    return Run(schedule).run()


def main() -> None:
    """Run the schedules that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    names = ", ".join(DIRECTED)
    parser.add_argument("first", help=f"seed of the first schedule, or one of: {names}")
    parser.add_argument(
        "end", type=int, nargs="?", help="seed after the last; only the first if left out"
    )
    parser.add_argument("--mood", choices=SCENARIOS, default="", help="drawn too if left out")
    wanted = parser.parse_args()
    schedules: Iterable[FaultSchedule]
    if wanted.first in DIRECTED:
        schedules = [DIRECTED[wanted.first]]
    elif wanted.first.isdecimal():
        first = int(wanted.first)
        end = first + 1 if wanted.end is None else wanted.end
        schedules = (draw(seed, wanted.scenario) for seed in range(first, end))
    else:
        parser.error(f"no schedule is called {wanted.first!r}; allowed: a seed, {names}")
    total: Counter[str] = Counter()
    for outcome in map(run, schedules):
        total.update(schedules=1, violations=bool(outcome.violation), events=outcome.events)
        total.update(takeovers=outcome.takeovers, **outcome.ended)
        if outcome.violation or wanted.end is None:
            sys.stdout.write(outcome.in_full())
    sys.stdout.write(", ".join(f"{count} {name}" for name, count in total.items()) + "\n")


if __name__ == "__main__":
    main()
