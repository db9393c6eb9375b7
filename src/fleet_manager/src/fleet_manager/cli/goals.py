# SPDX-License-Identifier: BSD-3-Clause
"""Goals as they are typed on the command line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from fleet_manager.cli.context import PLACE_NAME
from fleet_manager.client.formats import natural
from fleet_manager.errors import InputError
from hive_common.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Mapping

    from click.shell_completion import CompletionItem

_TURN = 360.0  # [°]


@dataclass(frozen=True)
class Goal:
    """A goal as typed: coordinates, or a place that the hive knows, and perhaps a heading.

    Attributes:
        text: All that was typed, which may be the name of a place with a comma in it.
        name: Of the place; empty for coordinates.
        at: x and y [m, map frame]; empty for a place.
        heading: [rad]; None where none is typed.
    """

    text: str
    name: str
    at: tuple[float, ...]
    heading: float | None

    def pose(self, places: Mapping[str, Pose]) -> Pose:
        """Return the pose in the map frame, with the places of the hive by name.

        Raises:
            InputError: There is no such place.
        """
        if not self.name:
            x, y = self.at
            return Pose(x, y, self.heading or 0.0)
        if self.text in places:
            return places[self.text]
        if self.name not in places:
            known = ", ".join(sorted(places, key=natural)) or "none"
            raise InputError(
                f"there is no place '{self.text}'; there are: {known}; allowed too: x,y or "
                "x,y,heading [m,m,°]"
            )
        place = places[self.name]
        return place if self.heading is None else Pose(place.x, place.y, self.heading)


class GoalParam(click.ParamType):
    """A goal typed as `x,y` or the name of a place, with a heading in degrees behind it or not."""

    name = "x,y[,heading]|place[,heading]"

    def convert(
        self,
        value: object,
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> Goal:
        """Return the goal, or fail with what is allowed."""
        if isinstance(value, Goal):
            return value
        text = str(value).strip()
        parts = [part.strip() for part in text.split(",")]
        numbers = [_number(part) for part in parts]
        is_place = numbers[0] is None or len(parts) == 1
        has_heading = len(parts) > (1 if is_place else 2) and numbers[-1] is not None
        heading = numbers[-1] if has_heading else None
        is_heading = heading is None or abs(heading) <= _TURN
        is_allowed = bool(parts[0]) if is_place else len(parts) in {2, 3} and None not in numbers
        if not is_allowed or not is_heading:
            self.fail(
                f"{value!r} is not a goal; allowed: x,y or x,y,heading [m,m,°], as in 3,4,90, or "
                "a place of the hive, as in 'test cell' or 'test cell,90'; a heading is from -360 "
                "to 360",
                param,
                ctx,
            )
        radians = None if heading is None else math.radians(heading)
        if is_place:
            return Goal(
                text, text.rpartition(",")[0].strip() if has_heading else text, (), radians
            )
        return Goal(text, "", tuple(each for each in numbers[:2] if each is not None), radians)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Return the places that begin with the typed text."""
        return PLACE_NAME.shell_complete(ctx, param, incomplete)


def _number(text: str) -> float | None:
    """Return a finite number; None for anything else."""
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None
