# SPDX-License-Identifier: BSD-3-Clause
"""What an operator is told about traffic: who waits in a circle, and where it is slow.

It takes what the coordinator knows of waiting robots and keeps the last ten minutes. It needs no
ROS, so that tests run it with virtual time.
"""

from __future__ import annotations

import heapq
import math
from collections import defaultdict, deque
from operator import attrgetter
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

WINDOW = 600.0  # how long waiting is remembered [s]
SIDE = 2.0  # of the squares by which places are told apart [m]
MOST_PLACES = 10  # so many slow places are told
LONG = 30.0  # a robot that waits for longer makes no progress [s]


class Waiting(NamedTuple):
    """A robot that stands because of another one.

    Attributes:
        robot: Who waits.
        waits_for: For whom.
        x, y: Where it stands, frame map [m].
        since: Since when [s].
    """

    robot: str
    waits_for: str
    x: float
    y: float
    since: float


class SlowPlace(NamedTuple):
    """A place where robots have waited.

    Attributes:
        x, y: The middle of those who waited, frame map [m].
        waited: How long, all together [s].
        waits: How often one has begun to wait.
    """

    x: float
    y: float
    waited: float
    waits: int


class _Sample(NamedTuple):
    time: float
    square: tuple[int, int]
    x: float
    y: float
    span: float  # how long the robot has waited since the sample before [s]
    begins: bool


def cycles(waits: Iterable[Waiting]) -> set[frozenset[str]]:
    """Return the sets of robots that wait for each other in a circle."""
    waits_for = {wait.robot: wait.waits_for for wait in waits}
    found, seen = set[frozenset[str]](), set[str]()
    for start in waits_for:
        trail: list[str] = []
        robot = start
        while robot in waits_for and robot not in seen:
            seen.add(robot)
            trail.append(robot)
            robot = waits_for[robot]
        if robot in trail:
            found.add(frozenset(trail[trail.index(robot) :]))
    return found


class TrafficReport:
    """Remembers who has waited where.

    Attributes:
        waits: Who waits now.
        cycles: The robots that wait for each other in a circle now.
        deadlocks: How many such circles there have been, each counted once.
    """

    def __init__(self) -> None:
        self.waits: tuple[Waiting, ...] = ()
        self.cycles: set[frozenset[str]] = set()
        self.deadlocks = 0
        self._now = -math.inf
        self._samples: deque[_Sample] = deque()

    def note(self, now: float, waits: Sequence[Waiting]) -> None:
        """Take in who waits at a time [s]; call it about once a second."""
        waited_before = {(wait.robot, wait.since) for wait in self.waits}
        if now < self._now:  # the clock was set back
            self._samples.clear()
        for wait in waits:
            span = max(0.0, now - max(wait.since, self._now))
            square = (math.floor(wait.x / SIDE), math.floor(wait.y / SIDE))
            begins = (wait.robot, wait.since) not in waited_before
            self._samples.append(_Sample(now, square, wait.x, wait.y, span, begins))
        while self._samples and self._samples[0].time < now - WINDOW:
            self._samples.popleft()
        found = cycles(waits)
        self.deadlocks += len(found - self.cycles)
        self._now, self.waits, self.cycles = now, tuple(waits), found

    def standing(self) -> list[Waiting]:
        """Return who has waited for longer than `LONG`."""
        return [wait for wait in self.waits if self._now - wait.since > LONG]

    def slowest(self) -> list[SlowPlace]:
        """Return where robots have waited longest in the last ten minutes, the slowest first."""
        at: dict[tuple[int, int], list[_Sample]] = defaultdict(list)
        for sample in self._samples:
            at[sample.square].append(sample)
        places = [
            SlowPlace(
                x=sum(sample.x for sample in there) / len(there),
                y=sum(sample.y for sample in there) / len(there),
                waited=sum(sample.span for sample in there),
                waits=sum(sample.begins for sample in there),
            )
            for there in at.values()
        ]
        return heapq.nlargest(MOST_PLACES, places, key=attrgetter("waited"))
