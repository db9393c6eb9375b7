# SPDX-License-Identifier: BSD-3-Clause
"""Follows paths by orders: the base of the order is what the traffic layer lets the AGV drive.

It takes the place of a follower that commands velocities, so the Navigator treats an AGV as it
treats every robot. What is released cannot be taken back, so the AGV claims all of it.

An AGV drives straight from node to node, and only its own scanners see what is in the way. So
every line that an order adds to the path, from where the AGV stands or from the end of its base,
has to be clear on the map.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import attrs

from hive_common.pose import Pose, Velocity
from hive_navigation.traffic.right_of_way import Limits
from vda5050.agent.order_keeper import Phase
from vda5050.agent.order_parts import Stop
from vda5050.protocol.order import Deviation, NodePosition

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from hive_navigation.control.follower import Room
    from hive_navigation.planning.clearance import ClearanceField
    from hive_navigation.planning.path import Path, Point
    from robot_description.models import Base
    from vda5050.agent.order_keeper import OrderKeeper

STEP = 0.8  # the base grows by at least so much, unless the AGV waits at its end [m]
LEAST = 0.15  # the base of an AGV that waits grows by at least so much [m]
AT_END = 0.3  # an AGV this near to the end of its base waits there, or soon will [m]
BESIDE = 0.15  # how far an AGV, or the end of its base, may be from a path that it takes up [m]
SHORT = 0.02  # a path whose rest is shorter is at its end [m]
AHEAD = 2.0  # how much time an AGV's base is ahead of it, besides braking [s]
LEAST_AHEAD = 2.0  # [m]
MORE = 1.5  # how much further the base goes for an AGV that asks for more
PASSING = 0.25  # how far from a node on its way an AGV may pass, where there is room [m]
NARROW = 0.05  # how far it may pass everywhere: no AGV is more exact [m]
MARGIN = 0.02  # clearance beyond the AGV's radius on lines to a path, as planned paths have it [m]
BEGINNING = 0.5  # how far from the first node of an order an AGV may be [m]


@attrs.frozen
class Tolerance:
    """How near an AGV has to come to the end of its path."""

    position: float  # [m]
    yaw: float  # [rad]


class OrderFollower:
    """Follows a path; see `hive_navigation.control.follower.Follower`.

    Args:
        base: Of the AGV's model.
        keeper: Of the AGV's order.
        to_agv: Turns a pose of the hive's map into one of the AGV's: x, y, yaw, map id.
        clock: Returns the time [s].
        tolerance: How near it has to come to the end.
        field: See below.

    Attributes:
        field: Clearances of the hive's map as it is now.
        is_off: Whether the AGV stands where no clear line leads to its path: it needs another one.
        velocity: How fast the AGV drives now, as it says.
        wants_more: Whether the AGV asks for a longer base.
        may_release: Whether the base may grow.
    """

    def __init__(
        self,
        base: Base,
        keeper: OrderKeeper,
        to_agv: Callable[[Pose], tuple[Pose, str]],
        clock: Callable[[], float],
        tolerance: Tolerance,
        field: ClearanceField,
    ) -> None:
        self.progress = self.committed = 0.0
        self.is_off = False
        self.arrived = True
        self.velocity = Velocity()
        self.wants_more = False
        self.may_release = True
        self._base = base
        self._keeper = keeper
        self._to_agv = to_agv
        self._clock = clock
        self._tolerance = tolerance
        self.field = field
        self._radius = base.circumscribed_radius
        self._path: Path | None = None
        self._yaw: float | None = None
        self._released = 0.0  # how much of the path belongs to the base [m]
        self._base_end: Point = (0.0, 0.0)  # frame map [m]
        self._ours = False  # whether the order is for this path
        brake = base.max_speed**2 / (2 * base.acceleration)
        self._reach = max(LEAST_AHEAD, brake + AHEAD * base.max_speed)

    def start(self, path: Path, goal_yaw: float | None) -> None:
        """Take up a path; an order whose base it does not hold is cancelled first."""
        held = self._held_by(path) if self._ours else None
        self._path, self._yaw = path, goal_yaw
        self.progress, self.arrived, self.is_off = 0.0, False, False
        if held is not None:
            self._released = held
            self._keeper.extend((), self._stops(held, path.length), self._clock())
            return
        self._drop_order()

    def command(self, pose: Pose, room: Room, dt: float) -> Velocity:
        """Release what there is room for; return how fast the AGV drives."""
        del dt
        path, keeper = self._path, self._keeper
        if path is None or self.arrived:
            return self.velocity
        here = (pose.x, pose.y)
        self.progress = path.nearest(here, self.progress - 0.2, self.progress + self._reach)
        if self._ours and keeper.completed and self._released >= path.length - SHORT:
            self._ours, self.arrived = False, True
        elif self.may_release and (self._ours or keeper.phase is Phase.IDLE):
            self._release(pose, self.progress + room.ahead)
        self.committed = max(0.0, self._released - self.progress) if self._ours else 0.0
        return self.velocity

    def halt(self, dt: float) -> Velocity:
        """Have the AGV drop the order for its path."""
        del dt
        if self._ours:
            self._ours, self.committed, self._path = False, 0.0, None
            if not self._keeper.completed:
                self._keeper.cancel(self._clock())
        return self.velocity

    def stopped(self) -> None:
        """Nothing to do: an AGV drives on without commands."""

    def top_speed(self, room: float) -> float:
        """Return the highest speed on a straight path that is free for `room` [m] ahead [m/s]."""
        return min(self._base.max_speed, math.sqrt(2 * self._base.acceleration * max(room, 0.0)))

    def limits(self, room: float) -> Limits:
        """Return how fast the AGV drives, speeds up and turns."""
        del room  # that of a laser, which limits no AGV
        base = self._base
        return Limits(base.max_speed, base.acceleration, base.max_yaw_rate)

    def _release(self, pose: Pose, limit: float) -> None:
        """Let the base grow up to a mark on the path, or as far as the AGV needs."""
        path = self._path
        assert path is not None  # noqa: S101  (the caller has looked)
        reach = self._reach * (MORE if self.wants_more else 1.0)
        start = self._released if self._ours else self.progress
        end = min(limit, self.progress + reach, path.length)
        at_end = path.length - end < SHORT
        end = path.length if at_end else end
        least = LEAST if start - self.progress < AT_END else STEP
        too_short = end - start < (SHORT if at_end else least)
        if too_short and (self._ours or not at_end or self._is_there(pose)):
            self.arrived = self.arrived or (not self._ours and at_end)
            return
        self._send(pose, start, end)

    def _is_there(self, pose: Pose) -> bool:
        path = self._path
        assert path is not None  # noqa: S101  (the caller has looked)
        turn = 0.0 if self._yaw is None else math.remainder(pose.yaw - self._yaw, math.tau)
        away = math.dist(path.end, pose[:2])
        return away <= self._tolerance.position / 2 and abs(turn) <= self._tolerance.yaw / 2

    def _send(self, pose: Pose, start: float, end: float) -> None:
        path = self._path
        assert path is not None  # noqa: S101  (the caller has looked)
        points = path.section(start, end)[1:] if end - start >= SHORT else [path.at(end)]
        begin = self._base_end if self._ours else (pose.x, pose.y)
        lead = self._lead(begin, path.at(start), points[0])
        if lead is None:
            self.is_off = not self._ours
            self._drop_order()
            return
        base = [self._stop(path, point) for point in (*lead, *points)]
        horizon = self._stops(end, path.length)
        self._released, self._base_end = end, points[-1]
        if self._ours:
            self._keeper.extend(base, horizon, self._clock())
            return
        self._ours = True
        first = self.stop_at(pose)
        self._keeper.begin([first, *base, *horizon], 1 + len(base), self._clock())

    def _lead(self, begin: Point, first: Point, following: Point) -> tuple[Point, ...] | None:
        """Return where to drive before the points of the path; None if no clear line leads to it.

        Args:
            begin: Where the new part of the order begins, frame map [m].
            first: Where its part of the path begins.
            following: The next point of the path.
        """
        away, clear = math.dist(begin, first), self.field.line_is_clear
        if away <= MARGIN:
            return ()
        if away > BESIDE:
            return None
        # Where there is less room than that already, it must not become still less.
        need = min(self._radius + MARGIN, self.field.at(*begin), self.field.at(*first))
        if clear(begin, following, need):
            return ()
        return (first,) if clear(begin, first, need) else None

    def _drop_order(self) -> None:
        self._ours, self._released = False, 0.0
        self._keeper.cancel(self._clock())

    def stop_at(self, pose: Pose) -> Stop:
        """Return the first node of an order, where the AGV is now."""
        place, map_id = self._to_agv(pose)
        free = Deviation(BEGINNING, BEGINNING)
        return Stop(NodePosition(place.x, place.y, map_id, None, free, math.pi))

    def _stops(self, start: float, end: float) -> list[Stop]:
        """Return the nodes from one mark of the path to another, without the first."""
        path = self._path
        assert path is not None  # noqa: S101  (the caller has looked)
        if end - start < SHORT:
            return []
        return [self._stop(path, point) for point in path.section(start, end)[1:]]

    def _stop(self, path: Path, point: Point) -> Stop:
        ends = math.dist(point, path.end) < SHORT
        yaw = self._yaw if ends else None
        place, map_id = self._to_agv(Pose(*point, yaw or 0.0))
        near = self._tolerance.position
        if not ends:
            near = min(max(self.field.at(*point) - self._radius, NARROW), PASSING)
        turn = math.pi if yaw is None else self._tolerance.yaw
        theta = None if yaw is None else place.yaw
        return Stop(NodePosition(place.x, place.y, map_id, theta, Deviation(near, near), turn))

    def _held_by(self, path: Path) -> float | None:
        """Return the mark of the end of the base on a path that leads over it; else None."""
        keeper = self._keeper
        if keeper.phase is not Phase.ACTIVE or self._path is None:
            return None
        rest = self._path.section(self.progress, self._released)
        return _mark_on(path, rest)


def _mark_on(path: Path, points: Iterable[Point]) -> float | None:
    """Return where the last of points is on a path that leads over all of them in order."""
    mark, before = 0.0, None
    for point in points:
        far = 1.0 if before is None else 1.0 + 1.5 * math.dist(before, point)
        mark, before = path.nearest(point, mark, mark + far), point
        if math.dist(path.at(mark), point) > BESIDE:
            return None
    return mark
