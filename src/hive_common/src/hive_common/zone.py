# SPDX-License-Identifier: BSD-3-Clause
"""Zones: areas of the map in which an operator limits how robots drive.

Fleet files hold them, and the traffic planner obeys them.
"""

from itertools import combinations
from math import pi
from typing import TYPE_CHECKING, Annotated

import attrs
import numpy as np

from hive_common.structuring import (
    Allowed,
    Name,
    NotAllowedError,
    between,
    one_of,
    positive,
)

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    from numpy.typing import NDArray

ONE_WAY = "one-way"
KEEP_OUT = "keep-out"
SLOW = "slow"
AT_MOST = "at-most"
NO_STOPPING = "no-stopping"
PARKING = "parking"

KINDS = (ONE_WAY, KEEP_OUT, SLOW, AT_MOST, NO_STOPPING, PARKING)

MIN_AREA = 0.01  # of a zone [m^2]

_DIRECTION = between(-2 * pi, 2 * pi, "an angle in the map frame [rad]")
_SPEED = positive("a speed [m/s]", 5)
_ROBOTS = between(1, 10_000, "a number of robots")

FIGURES = {
    ONE_WAY: ("direction", _DIRECTION),
    SLOW: ("speed", _SPEED),
    AT_MOST: ("robots", _ROBOTS),
}
"""The key that a kind of zone needs, and that no other kind has, and what is allowed for it."""

Corner = tuple[float, float]


@attrs.frozen(kw_only=True)
class Zone:
    """A polygon on the map, and what holds in it."""

    name: Name
    """What operators call it."""
    kind: Annotated[str, one_of(*KINDS)]
    """`one-way`: nobody drives against `direction`. `keep-out`: no part of a robot enters.
    `slow`: nobody drives faster than `speed`. `at-most`: no more than `robots` are in it.
    `no-stopping`: nobody stops on the way or parks. `parking`: idle robots may stay."""
    corners: Annotated[
        tuple[Annotated[tuple[float, float], Allowed("[x, y] in the map frame [m]")], ...],
        Allowed(
            "a list of at least 3 corners [x, y] in the map frame [m]",
            lambda corners: len(corners) >= 3,  # noqa: PLR2004  (a triangle)
        ),
    ]
    """Of the polygon, one after the other."""
    direction: (
        Annotated[float, between(-2 * pi, 2 * pi, "an angle in the map frame [rad]")] | None
    ) = None
    """In which robots drive through a one-way zone."""
    speed: Annotated[float, _SPEED] | None = None
    """Highest speed in a slow zone."""
    robots: Annotated[int, _ROBOTS] | None = None
    """How many may be in an at-most zone at once."""
    closed: bool = False
    """Whether it is closed at the start: a closed zone keeps robots out, whatever its kind."""

    def __attrs_post_init__(self) -> None:
        for kind, (key, rule) in FIGURES.items():
            given = getattr(self, key)
            if kind == self.kind and given is None:
                raise NotAllowedError((key,), f"missing; allowed: {rule.text}")
            if kind != self.kind and given is not None:
                problem = f"{given:g}; allowed: only in zones of the kind {kind}, not {self.kind}"
                raise NotAllowedError((key,), problem)
        area = abs(_area(self.corners))
        if _crosses_itself(self.corners) or area < MIN_AREA:
            raise NotAllowedError(
                ("corners",),
                f"an area of {area:.3g} m^2, or edges that cross; allowed: corners in their order "
                f"around the zone, at least {MIN_AREA:g} m^2",
            )


def inside(corners: "NDArray[np.float64]", points: "NDArray[np.float64]") -> "NDArray[np.bool_]":
    """Return which points (n, 2) lie in a polygon with corners (k, 2), by counting crossings."""
    x, y = points[:, :1], points[:, 1:]
    ahead = np.roll(corners, -1, axis=0)
    rises = ahead[:, 1] - corners[:, 1]
    spans = (corners[:, 1] <= y) != (ahead[:, 1] <= y)
    share = (y - corners[:, 1]) / np.where(rises == 0, 1.0, rises)
    crossed = spans & (x < corners[:, 0] + share * (ahead[:, 0] - corners[:, 0]))
    found: NDArray[np.bool_] = crossed.sum(axis=1) % 2 == 1
    return found


def with_closed(zones: "Iterable[Zone]", closed: "Collection[str]") -> tuple[Zone, ...]:
    """Return zones of which those with these names are closed, and no others."""
    return tuple(attrs.evolve(each, closed=each.name in closed) for each in zones)


def keeping_out(zones: "Iterable[Zone]") -> tuple[Zone, ...]:
    """Return those of some zones that no part of a robot may enter now."""
    return tuple(each for each in zones if each.closed or each.kind == KEEP_OUT)


def _area(corners: tuple[Corner, ...]) -> float:
    """Return the area of a polygon [m^2]; positive if the corners run counter-clockwise."""
    turned = (*corners[1:], corners[0])
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(corners, turned, strict=True)) / 2


def _crosses_itself(corners: tuple[Corner, ...]) -> bool:
    """Return whether two edges of a polygon cross."""
    edges = list(zip(corners, (*corners[1:], corners[0]), strict=True))

    def apart(one: tuple[Corner, Corner], other: tuple[Corner, Corner]) -> bool:
        return _area((*one, other[0])) * _area((*one, other[1])) >= 0

    return any(
        not apart(one, other) and not apart(other, one) for one, other in combinations(edges, 2)
    )
