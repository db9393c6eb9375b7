# SPDX-License-Identifier: BSD-3-Clause
"""Simulated traffic whose planner, messages and positions fail.

The planner may be killed, frozen or cut off from robots, messages be lost or late, and a robot may
report a wrong position. The robots are to touch nobody whatever happens.
"""

from __future__ import annotations

import heapq
import itertools
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_lab.fleets.traffic import STEP, STEPS_PER_ROUND, STEPS_TO_HEAR, Traffic
from hive_navigation.traffic.neighbourhood import Neighbourhood

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array
    from hive_common.grid_map import GridMap
    from hive_common.pose import Pose
    from hive_lab.fleets.coordination import CoordinatorMaker
    from hive_navigation.mapf.route import Route
    from hive_navigation.traffic.coordinator import Coordinator
    from hive_navigation.traffic.right_of_way import Announcement
    from simenv.simulation import Simulation

KINDS = ("killed", "frozen", "cut off", "lossy", "misplaced")
TAKEOVER = 2.0  # from the death or freeze of a planner's host to the next planner [s]
LONGEST = 10.0  # of a fault [s]
LOST = 0.3  # share of the messages that are lost
LATE = 0.6  # the longest further delay of a message [s]
OFF = 0.3  # how far a wrong position is off [m]


@dataclass(frozen=True)
class Fault:
    """Something that fails for a time.

    Attributes:
        kind: One of `KINDS`.
        begin, end: From when to when [s].
        robots: Whom it affects, if not all.
        angle: The direction in which a wrong position is off, frame map [rad].
    """

    kind: str
    begin: float
    end: float
    robots: frozenset[str] = frozenset()
    angle: float = 0.0


def draw_faults(names: Sequence[str], seconds: float, seed: int) -> tuple[Fault, ...]:
    """Draw faults of random kinds, one about every 10 s; they may overlap."""
    random = np.random.default_rng((seed, 1))
    faults = []
    for _ in range(max(1, round(seconds / LONGEST))):
        kind = str(random.choice(KINDS))
        begin = float(random.uniform(0.0, seconds))
        count = 1 if kind == "misplaced" else int(random.integers(1, len(names) + 1))
        robots = frozenset(map(str, random.choice(names, count, replace=False)))
        lasts = float(random.uniform(0.5, LONGEST))
        angle = float(random.uniform(-math.pi, math.pi))
        faults.append(Fault(kind, begin, begin + lasts, robots, angle))
    return tuple(faults)


@dataclass
class _Host:
    """A process that plans.

    Attributes:
        coordinator: The planner.
        wakes: Until when it is frozen [s].
        inbox: What it has not read.
    """

    coordinator: Coordinator
    wakes: float
    inbox: list[Announcement]


class _Message(NamedTuple):
    due: int  # the step in which it is there
    number: int  # counts all messages: a heap never compares what they hold
    receiver: str | _Host
    sender: str  # a robot; empty for a planner
    content: Announcement | tuple[Route, ...]


class FaultyTraffic(Traffic):
    """Robots and planners that fail by a schedule."""

    def __init__(
        self,
        simulation: Simulation,
        grid: GridMap,
        maker: CoordinatorMaker,
        faults: Sequence[Fault],
        seed: int,
    ) -> None:
        """Begin with one planner; the seed decides which messages are lost or late."""
        super().__init__(simulation, grid)
        self._faults = tuple(faults)
        self._maker = maker
        self._epoch = 1
        self._hosts = [_Host(maker.coordinator(1), 0.0, [])]
        self._next_host_at = math.inf
        self._begun: set[Fault] = set()
        self._random = np.random.default_rng((seed, 2))
        self._ears: dict[str, Neighbourhood] = {}
        self._post: list[_Message] = []
        self._numbers = itertools.count()

    def step(self) -> None:
        """Advance by one step."""
        now = self._simulation.time
        self._fail(now)
        due = [name for name in self._due() if name not in self.held_up]
        poses, scans = self._simulation.poses, self._simulation.scans(due) if due else []
        for name, ranges in zip(due, scans, strict=True):
            self._round(name, poses[name], ranges)
        while self._post and self._post[0].due <= self._steps:
            self._deliver(heapq.heappop(self._post), now)
        if self._steps % STEPS_PER_ROUND == 0:
            for host in tuple(self._hosts):
                self._let_plan(host, now)
        self._simulation.step(STEP)
        self._steps += 1

    def _round(self, name: str, pose: Pose, ranges: Array) -> None:
        now = self._simulation.time
        heard = self._ears.setdefault(name, Neighbourhood())
        tick = self.navigators[name].tick(now, pose, self.scan_of(name, ranges), heard)
        self._simulation.set_command(name, *tick.velocity)
        said = tick.announcement
        for fault in self._active(now, "misplaced", name):
            said = _moved(said, OFF * math.cos(fault.angle), OFF * math.sin(fault.angle))
        receivers: list[str | _Host] = [*self.navigators, *self._hosts]
        for receiver in receivers:
            self._send(receiver, name, said, now)
        if tick.outcome is not None:
            self.outcomes[name] = tick.outcome

    def _send(
        self,
        receiver: str | _Host,
        sender: str,
        content: Announcement | tuple[Route, ...],
        now: float,
    ) -> None:
        """Post a message, unless it gets lost."""
        late = 0
        robot = receiver if isinstance(receiver, str) else sender
        to_or_from_planner = not (isinstance(receiver, str) and sender)
        if to_or_from_planner and self._active(now, "cut off", robot):
            return
        if receiver != sender and self._active(now, "lossy", robot):
            if self._random.random() < LOST:
                return
            late = round(self._random.uniform(0.0, LATE) / STEP)
        due = self._steps + STEPS_TO_HEAR + late
        heapq.heappush(self._post, _Message(due, next(self._numbers), receiver, sender, content))

    def _deliver(self, message: _Message, now: float) -> None:
        receiver, content = message.receiver, message.content
        if isinstance(receiver, _Host):
            if not isinstance(content, tuple):
                receiver.inbox.append(content)
        elif isinstance(content, tuple):
            self.navigators[receiver].take_routes(content, now)
        else:
            self._ears.setdefault(receiver, Neighbourhood()).hear(content)

    def _let_plan(self, host: _Host, now: float) -> None:
        if now < host.wakes:
            return
        for said in host.inbox:
            host.coordinator.hear(said)
        host.inbox.clear()
        routes = host.coordinator.step(now)
        if host is not self._hosts[-1]:
            self._hosts.remove(host)
        if routes:
            for name in self.navigators:
                self._send(name, "", routes, now)

    def _fail(self, now: float) -> None:
        """Kill and freeze planners, and start the next one when the time has come."""
        for fault in self._faults:
            if fault.begin > now or fault in self._begun:
                continue
            self._begun.add(fault)
            if fault.kind == "killed":
                self._hosts = [host for host in self._hosts if now < host.wakes]
            elif fault.kind == "frozen":
                for host in self._hosts:
                    host.wakes = max(host.wakes, fault.end)
            else:
                continue
            self._next_host_at = min(self._next_host_at, now + TAKEOVER)
        if now >= self._next_host_at:
            self._next_host_at = math.inf
            self._take_over(now)

    def _take_over(self, now: float) -> None:
        """Start a planner of the next epoch, unless the last one is awake again.

        One that is still frozen plans once more when it wakes; then it hears of the new one, and
        ends.
        """
        if self._hosts and now >= self._hosts[-1].wakes:
            return
        self._epoch += 1
        self._hosts.append(_Host(self._maker.coordinator(self._epoch), 0.0, []))

    def _active(self, now: float, kind: str, robot: str) -> list[Fault]:
        """Return the faults of a kind that affect a robot now."""
        return [
            fault
            for fault in self._faults
            if fault.kind == kind and fault.begin <= now < fault.end and robot in fault.robots
        ]


def _moved(said: Announcement, dx: float, dy: float) -> Announcement:
    """Return an announcement whose positions are off [m]."""
    path = tuple((x + dx, y + dy) for x, y in said.path)
    return replace(said, x=said.x + dx, y=said.y + dy, path=path)
