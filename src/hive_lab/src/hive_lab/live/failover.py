# SPDX-License-Identifier: BSD-3-Clause
"""Measures how long a hive on real ROS is without a leader, and how a busy machine disturbs it.

A blackboard node and four robot nodes run on a ROS master of their own; nothing drives. The leader
is killed (`kill -9`) or suspended (SIGSTOP), and the time to the next leader's first heartbeat is
measured on the wall clock. The member is back before the next round, and the leader has led for
some seconds, so that it knows how quickly the others answer. The blackboard node leads in
the first round; then whoever took over does, so most rounds hit a robot's process.

Last, other programs take the processors for a while: takeovers are counted, and the longest time
between two heartbeats of the leader is measured.
"""

from __future__ import annotations

import signal
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from hive_lab.bench.registry import BenchResult
from hive_lab.live.live_hive import bench_hive

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_lab.live.live_hive import LiveHive
    from hive_lab.live.live_operator import LiveOperator

RUNS = 20  # number of each fault by default

AIMS = {"crash_median": 0.5, "crash_worst": 1.5, "freeze_worst": 1.0, "busy_takeovers": 0.0}
"""From the fault to the next leader's first heartbeat [s]; takeovers on a busy machine [1]."""

_GREEDY, _BUSY_FOR = 20, 60.0
"""Programs that take the processors, and for how long [s]."""

_SETTLED = 8.0
"""A leader knows how quickly the others answer when it has led for this long [s]."""

_FAULTS = (("crash", signal.SIGKILL), ("freeze", signal.SIGSTOP))


@dataclass(frozen=True)
class Gap:
    """One takeover.

    Attributes:
        fault: `crash` or `freeze`.
        carrier: Node of the former leader.
        seconds: From the fault to the next leader's first heartbeat [s].
        of_robot: Whether the former leader was a robot.
    """

    fault: str
    carrier: str
    seconds: float
    of_robot: bool


def _round(hive: LiveHive, operator: LiveOperator, fault: str, what: signal.Signals) -> Gap:
    """Inject one fault into the leader; return the gap."""
    active = operator.wait_until_whole()
    _wait_until_settled(operator)
    patience = operator.last.patience
    operator.forget_answers()
    since = time.monotonic()
    hive.signal(active, what)
    gap = operator.wait_for_another(active, since)
    if what is signal.SIGKILL:
        hive.start(active)
    else:
        hive.thaw(active)
    told = f"{gap:.2f} s; the others were to wait {patience:.2f} s"
    sys.stderr.write(f"{what.name} of {active}: {told}\n")
    return Gap(fault, active, gap, bool(hive.robot_of(active)))


def _wait_until_settled(operator: LiveOperator) -> None:
    epoch = operator.last.epoch
    began = next(at for at, beat in operator.beats if beat.epoch == epoch)
    operator.pass_time(max(0.0, began + _SETTLED - time.monotonic()))


def _while_busy(hive: LiveHive, operator: LiveOperator) -> dict[str, float]:
    """Return what happens while other programs take the processors."""
    operator.wait_until_whole()
    _wait_until_settled(operator)
    epoch, begun = operator.last.epoch, time.monotonic()
    loop = [sys.executable, "-c", "while True: pass"]
    greedy = [subprocess.Popen(loop) for _ in range(_GREEDY)]  # noqa: S603  (named above)
    try:
        operator.pass_time(_BUSY_FOR)
    finally:
        for program in greedy:
            program.kill()
            program.wait()
    takeovers = operator.last.epoch - epoch
    sent = [at for at, _ in operator.beats if at >= begun]
    longest = max((later - earlier for earlier, later in pairwise(sent)), default=_BUSY_FOR)
    sys.stderr.write(f"{_GREEDY} greedy programs beside {len(hive.members)} members: ")
    sys.stderr.write(f"{takeovers} takeovers, {longest:.2f} s between heartbeats at most\n")
    return {"busy_takeovers": float(takeovers), "busy_longest_gap": longest}


def figures_of(gaps: Sequence[Gap]) -> dict[str, float]:
    """Return median, worst and best [s] by fault, and by fault of a robot."""
    figures: dict[str, float] = {}
    for fault, _ in _FAULTS:
        every = [gap.seconds for gap in gaps if gap.fault == fault]
        robots = [gap.seconds for gap in gaps if gap.fault == fault and gap.of_robot]
        for name, some in ((fault, every), (f"{fault}_of_robot", robots)):
            figures[f"{name}_runs"] = float(len(some))
            if some:
                figures[f"{name}_median"] = statistics.median(some)
                figures[f"{name}_worst"] = max(some)
                figures[f"{name}_best"] = min(some)
    return figures


def histogram(gaps: Sequence[Gap], fault: str, width: float = 0.1) -> list[str]:
    """Return a histogram of the gaps of one kind of fault, with classes of a width [s]."""
    classes = [int(gap.seconds / width) for gap in gaps if gap.fault == fault]
    if not classes:
        return []
    return [
        f"{each * width:4.1f} to {(each + 1) * width:4.1f} s  {'#' * classes.count(each)}".rstrip()
        for each in range(min(classes), max(classes) + 1)
    ]


def run(runs: int = RUNS) -> BenchResult:
    """Measure `runs` crashes and freezes each, and a busy machine; distributions go to stderr."""
    with bench_hive("bench_failover") as (hive, operator):
        gaps = [_round(hive, operator, *fault) for fault in _FAULTS for _ in range(runs)]
        busy = _while_busy(hive, operator)
    for fault, _ in _FAULTS:
        sys.stderr.write("\n".join([f"{fault}:", *histogram(gaps, fault), ""]))
    figures = {name: round(value, 3) for name, value in (figures_of(gaps) | busy).items()}
    return BenchResult(figures, dict(AIMS))
