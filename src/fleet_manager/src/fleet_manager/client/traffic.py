# SPDX-License-Identifier: BSD-3-Clause
"""What the traffic planner reports, and how a person reads it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fleet_manager.client.formats import duration
from fleet_manager.client.words import Event, Severity

if TYPE_CHECKING:
    from collections.abc import Iterator

LONG = 30.0  # a robot that waits for longer is worth an event [s]


@dataclass(frozen=True, slots=True)
class RobotWait:
    """A robot that stands because of another one, at x and y [m, map frame]."""

    robot: str
    waits_for: str
    x: float
    y: float
    since: float  # [s, hive's time]

    @property
    def words(self) -> str:
        """Whom it waits for, and where."""
        return f"waits for {self.waits_for} at ({self.x:.1f}, {self.y:.1f})"


@dataclass(frozen=True, slots=True)
class SlowPlace:
    """A place, x and y [m, map frame], where robots have waited in the last ten minutes."""

    x: float
    y: float
    waited: float  # all together [s]
    waits: int  # how often one has begun to wait


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
    deadlocks: int = 0  # circles of waiting robots so far

    def words_of(self, robot: str) -> str:
        """Return whom a robot waits for, and where; empty if it does not wait."""
        return next((wait.words for wait in self.waits if wait.robot == robot), "")


@dataclass(frozen=True, slots=True)
class ZoneCommand:
    """Ask the traffic planner to close a zone, or to open it."""

    zone: str
    closed: bool


def traffic_change(before: TrafficState | None, now: TrafficState) -> Iterator[Event]:
    """Tell zones that were closed or opened, robots that begin to wait for long, and circles."""
    if before is None:
        for zone in now.closed:
            yield Event(f"zone {zone} is closed")
        return
    for zone in sorted({*now.closed} - {*before.closed}):
        yield Event(f"zone {zone} was closed")
    for zone in sorted({*before.closed} - {*now.closed}):
        yield Event(f"zone {zone} was opened")
    told = {(w.robot, w.since) for w in before.waits if before.time - w.since > LONG}
    for wait in now.waits:
        if now.time - wait.since > LONG and (wait.robot, wait.since) not in told:
            text = f"{wait.robot} {wait.words} for more than {LONG:g} s"
            yield Event(text, Severity.WARNING)
    if now.epoch == before.epoch and now.deadlocks > before.deadlocks:
        names = ", ".join(sorted(wait.robot for wait in now.waits))
        yield Event(f"robots wait for each other in a circle, among {names}", Severity.WARNING)


def traffic_data(state: TrafficState) -> dict[str, Any]:
    """Return traffic as plain data; places in m, times in s."""
    return {
        "robots": list(state.robots),
        "waits": [
            {
                "robot": wait.robot,
                "waits_for": wait.waits_for,
                "x": wait.x,
                "y": wait.y,
                "for": max(0.0, state.time - wait.since),
            }
            for wait in state.waits
        ],
        "zones": [{"name": name, "closed": name in state.closed} for name in state.zones],
        "slowest": [
            {"x": place.x, "y": place.y, "waited": place.waited, "waits": place.waits}
            for place in state.slowest
        ],
        "deadlocks": state.deadlocks,
    }


def wait_rows(state: TrafficState) -> list[tuple[str, ...]]:
    """Return a row for each robot that waits, the longest first."""
    waits = sorted(state.waits, key=lambda wait: wait.since)
    return [
        (w.robot, w.waits_for, f"{w.x:.1f}, {w.y:.1f}", duration(state.time - w.since))
        for w in waits
    ]


def place_rows(state: TrafficState) -> list[tuple[str, ...]]:
    """Return a row for each slow place."""
    return [
        (f"{each.x:.1f}, {each.y:.1f}", duration(each.waited), str(each.waits))
        for each in state.slowest
    ]
