# SPDX-License-Identifier: BSD-3-Clause
"""What the traffic planner reports, and how a person reads it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from fleet_manager.client.formats import duration, natural
from fleet_manager.client.words import Event, Severity

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

CIRCLE = "circle"  # the kind of lock of robots that wait for each other
LONG = 30.0  # a robot that waits for longer is worth an event [s]
MOST_SHOWN = 10  # of the slow places that the planner tells


@dataclass(frozen=True, slots=True)
class RobotWait:
    """A robot that stands because of another one, at x and y [m, map frame]."""

    robot: str
    waits_for: str
    x: float
    y: float
    since: float  # [s, hive's time]
    where: str  # in words

    @property
    def words(self) -> str:
        """Whom it waits for, and where."""
        return f"waits for {self.waits_for} {self.where}"


@dataclass(frozen=True, slots=True)
class SlowPlace:
    """A place, x and y [m, map frame], where robots have waited in the last ten minutes."""

    x: float
    y: float
    waited: float  # all together [s]
    waits: int  # how often one has begun to wait
    where: str  # in words
    delay: float = 0.0  # what a robot that passes there loses at present, in the mean [s]


@dataclass(frozen=True, slots=True)
class Lock:
    """Robots that cannot go on."""

    kind: str  # see TrafficLock.msg
    robots: tuple[str, ...]
    since: float  # [s, hive's time]
    text: str  # in words, with the places

    @property
    def who(self) -> tuple[str, ...]:
        """The robots that it is about: of a circle all, else the one that makes no progress."""
        return self.robots if self.kind == CIRCLE else self.robots[:1]


@dataclass(frozen=True, slots=True)
class TrafficState:
    """What the planner of an epoch tells once a second."""

    epoch: int
    time: float  # when it was so [s, hive's time]
    robots: tuple[str, ...] = ()  # all that are planned for
    zones: tuple[str, ...] = ()  # the names of all
    closed: tuple[str, ...] = ()  # of those that are closed
    waits: tuple[RobotWait, ...] = ()
    slowest: tuple[SlowPlace, ...] = ()  # the slowest first
    locks: tuple[Lock, ...] = ()  # robots that cannot go on now
    counts: Mapping[str, int] = field(default_factory=dict)  # of locks so far, by kind
    unreached: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # places, by robot
    status: str = ""  # why no traffic planner plans now; empty when one does

    def words_of(self, robot: str) -> str:
        """Return whom a robot waits for, or why it stands, and where; empty if it goes on."""
        waits = next((wait.words for wait in self.waits if wait.robot == robot), "")
        alone = (lock.text for lock in self.locks if lock.robots == (robot,))
        return waits or next(alone, "").removeprefix(f"{robot} ")


@dataclass(frozen=True, slots=True)
class ZoneCommand:
    """Ask the traffic planner to close a zone, or to open it."""

    zone: str
    closed: bool


def traffic_change(before: TrafficState | None, now: TrafficState) -> Iterator[Event]:
    """Tell zones that were closed or opened, long waits, locks, and places out of reach."""
    if now.status and not (before and before.status):
        text = f"no traffic is planned now, robots drive by right of way: {now.status}"
        yield Event(text, Severity.WARNING)
    elif before and before.status and not now.status:
        yield Event("traffic is planned")
    closed = set() if before is None else {*before.closed}
    for zone in sorted({*now.closed} - closed):
        yield Event(f"zone {zone} {'is' if before is None else 'was'} closed")
    for zone in sorted(closed - {*now.closed}):
        yield Event(f"zone {zone} was opened")
    known = {} if before is None else before.unreached
    new = {
        robot: tuple(place for place in places if place not in known.get(robot, ()))
        for robot, places in now.unreached.items()
    }
    for text in out_of_reach(new):
        yield Event(text, Severity.WARNING)
    told = set() if before is None else {lock.who for lock in before.locks}
    for lock in now.locks:
        if lock.who not in told:
            yield Event(f"cannot go on: {lock.text}", Severity.WARNING)
    if before is not None:
        yield from _long_waits(before, now)


def _long_waits(before: TrafficState, now: TrafficState) -> Iterator[Event]:
    """Tell robots that begin to wait for long, unless they are part of a lock."""
    locked = {name for lock in now.locks for name in lock.robots}
    told = {(w.robot, w.since) for w in before.waits if before.time - w.since > LONG}
    for wait in now.waits:
        is_new = now.time - wait.since > LONG and (wait.robot, wait.since) not in told
        if is_new and wait.robot not in locked:
            text = f"{wait.robot} {wait.words} for more than {LONG:g} s"
            yield Event(text, Severity.WARNING)


def traffic_data(state: TrafficState) -> dict[str, Any]:
    """Return traffic as plain data; places in m, times in s."""
    return {
        "status": state.status,
        "robots": list(state.robots),
        "waits": [
            {
                "robot": wait.robot,
                "waits_for": wait.waits_for,
                "x": wait.x,
                "y": wait.y,
                "where": wait.where,
                "for": max(0.0, state.time - wait.since),
            }
            for wait in state.waits
        ],
        "zones": [{"name": name, "closed": name in state.closed} for name in state.zones],
        "slowest": [
            {
                "x": place.x,
                "y": place.y,
                "where": place.where,
                "waited": place.waited,
                "waits": place.waits,
                "delay": place.delay,
            }
            for place in state.slowest
        ],
        "locks": [
            {
                "kind": lock.kind,
                "robots": list(lock.robots),
                "for": max(0.0, state.time - lock.since),
                "text": lock.text,
            }
            for lock in state.locks
        ],
        "locks_so_far": dict(state.counts),
        "unreached": {robot: list(places) for robot, places in state.unreached.items()},
    }


def wait_rows(state: TrafficState) -> list[tuple[str, ...]]:
    """Return a row for each robot that waits, the longest first."""
    waits = sorted(state.waits, key=lambda wait: wait.since)
    return [(w.robot, w.waits_for, w.where, duration(state.time - w.since)) for w in waits]


def place_rows(state: TrafficState) -> list[tuple[str, ...]]:
    """Return a row for each of the slowest places."""
    return [
        (f"{each.x:.1f}, {each.y:.1f}", each.where, duration(each.waited), str(each.waits))
        for each in state.slowest[:MOST_SHOWN]
    ]


def lock_lines(state: TrafficState) -> list[str]:
    """Return in words who cannot go on and how often that was, and what is out of reach."""
    lines = [
        f"cannot go on for {duration(state.time - lock.since)}: {lock.text}"
        for lock in state.locks
    ]
    lines += out_of_reach(state.unreached)
    counts = [f"{kind} {count}" for kind, count in state.counts.items() if count]
    return [*lines, f"locks so far: {', '.join(counts)}"] if counts else lines


def out_of_reach(unreached: Mapping[str, Sequence[str]]) -> list[str]:
    """Return which robots cannot reach which places, robots with the same ones together."""
    together: dict[tuple[str, ...], list[str]] = {}
    for robot, places in sorted(unreached.items(), key=lambda item: natural(item[0])):
        if places:
            together.setdefault(tuple(places), []).append(robot)
    return [
        f"{', '.join(robots)} cannot reach {', '.join(places)}"
        for places, robots in together.items()
    ]
