# SPDX-License-Identifier: BSD-3-Clause
"""What an operator is told about traffic: who waits, who cannot go on, and where it is slow.

It takes what the coordinator knows of waiting robots and keeps the last ten minutes. It needs no
ROS, so that tests run it with virtual time.
"""

from __future__ import annotations

import heapq
import math
from collections import Counter, defaultdict, deque
from operator import attrgetter
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hive_navigation.planning.path import Point
    from hive_navigation.traffic.deadlock import Kind, LockWatch
    from hive_navigation.traffic.landmarks import Landmarks

WINDOW = 600.0  # how long waiting is remembered [s]
SIDE = 2.0  # of the squares by which places are told apart [m]
RECENT = 120.0  # how far back what a robot loses at a place is reckoned [s]
MOST_PLACES = 50  # so many slow places are told
LONG = 30.0  # a robot that waits for longer makes no progress [s]


class Waiting(NamedTuple):
    """A robot that stands because of another one.

    Attributes:
        robot: Who waits.
        waits_for: For whom.
        x, y: Where it stands, frame map [m].
        since: Since when [s].
        where: The same place in words.
    """

    robot: str
    waits_for: str
    x: float
    y: float
    since: float
    where: str = ""


class Locked(NamedTuple):
    """Robots that cannot go on.

    Attributes:
        kind: Why.
        robots: See `traffic.deadlock.Lock`.
        since: Since when [s].
        text: The same in words.
    """

    kind: Kind
    robots: tuple[str, ...]
    since: float
    text: str


class SlowPlace(NamedTuple):
    """A place where robots have waited.

    Attributes:
        x, y: The middle of those who waited, frame map [m].
        waited: How long, all together [s].
        waits: How often one has begun to wait.
        where: The same place in words.
        delay: What a robot that passes there loses at present, in the mean [s].
    """

    x: float
    y: float
    waited: float
    waits: int
    where: str
    delay: float


Square = tuple[int, int]


class _Sample(NamedTuple):
    time: float
    square: Square
    x: float
    y: float
    span: float  # how long the robot has waited since the sample before [s]
    begins: bool


class TrafficReport:
    """Remembers who has waited where.

    Attributes:
        waits: Who waits now.
        locks: Who cannot go on now.
        counts: How many locks of each kind there have been.
        unreached: By robot, the names of the places that it cannot reach; the caller fills it.
    """

    def __init__(self, landmarks: Landmarks, watch: LockWatch) -> None:
        self.waits: tuple[Waiting, ...] = ()
        self.locks: tuple[Locked, ...] = ()
        self.counts: Counter[Kind] = watch.counts
        self.unreached: dict[str, list[str]] = {}
        self._landmarks = landmarks
        self._watch = watch
        self._now = -math.inf
        self._samples: deque[_Sample] = deque()
        self._squares: dict[str, Square] = {}  # where each robot was last
        self._passes: deque[tuple[float, Square]] = deque()  # when robots have entered squares

    def note(
        self, now: float, waits: Sequence[Waiting], at: Mapping[str, Point] | None = None
    ) -> None:
        """Take in what is so now; call it about once a second.

        Args:
            now: The time [s].
            waits: Who waits for whom.
            at: Where each robot is, by name, frame map [m].
        """
        self._note_passes(now, at or {})
        waited_before = {(wait.robot, wait.since) for wait in self.waits}
        if now < self._now:  # the clock was set back
            self._samples.clear()
            self._passes.clear()
        for wait in waits:
            span = max(0.0, now - max(wait.since, self._now))
            square = _square((wait.x, wait.y))
            begins = (wait.robot, wait.since) not in waited_before
            self._samples.append(_Sample(now, square, wait.x, wait.y, span, begins))
        while self._samples and self._samples[0].time < now - WINDOW:
            self._samples.popleft()
        where = self._landmarks.where
        self.waits = tuple(wait._replace(where=where((wait.x, wait.y))) for wait in waits)
        self.locks = tuple(
            Locked(lock.kind, lock.robots, lock.since, self._landmarks.words_of(lock))
            for lock in self._watch.locks
        )
        self._now = now

    def _note_passes(self, now: float, at: Mapping[str, Point]) -> None:
        """Count who has come from one square into another."""
        squares = {robot: _square(point) for robot, point in at.items()}
        self._passes += [
            (now, square)
            for robot, square in squares.items()
            if self._squares.get(robot, square) != square
        ]
        self._squares = squares
        while self._passes and self._passes[0][0] < now - RECENT:
            self._passes.popleft()

    def standing(self) -> list[Waiting]:
        """Return who has waited for longer than `LONG`."""
        return [wait for wait in self.waits if self._now - wait.since > LONG]

    def slowest(self) -> list[SlowPlace]:
        """Return where robots have waited longest in the last ten minutes, the slowest first."""
        at: dict[tuple[int, int], list[_Sample]] = defaultdict(list)
        for sample in self._samples:
            at[sample.square].append(sample)
        passes = Counter(square for _, square in self._passes)
        places = []
        for square, there in at.items():
            x = sum(sample.x for sample in there) / len(there)
            y = sum(sample.y for sample in there) / len(there)
            waited = sum(sample.span for sample in there)
            waits = sum(sample.begins for sample in there)
            lately = sum(sample.span for sample in there if sample.time >= self._now - RECENT)
            delay = lately / max(1, passes[square])
            places.append(SlowPlace(x, y, waited, waits, self._landmarks.where((x, y)), delay))
        return heapq.nlargest(MOST_PLACES, places, key=attrgetter("waited"))


def _square(point: Point) -> Square:
    """Return the square in which a point lies."""
    return math.floor(point[0] / SIDE), math.floor(point[1] / SIDE)


def out_of_reach(unreached: Mapping[str, Sequence[str]]) -> list[str]:
    """Return in words which robots cannot reach which places, robots with the same ones together.

    Args:
        unreached: By robot, the names of the places.
    """
    together: dict[tuple[str, ...], list[str]] = defaultdict(list)
    for robot, places in sorted(unreached.items()):
        if places:
            together[tuple(places)].append(robot)
    return [
        f"{', '.join(robots)} cannot reach {', '.join(places)}"
        for places, robots in together.items()
    ]
