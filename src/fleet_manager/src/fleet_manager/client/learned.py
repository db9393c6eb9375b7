# SPDX-License-Identifier: BSD-3-Clause
"""What robots have learned of their steps, for a person: how well they predict, and by what."""

from __future__ import annotations

import math
from statistics import median, quantiles
from typing import TYPE_CHECKING

from blackboard.costing.experience import Learned
from blackboard.costing.saved_experience import saved_from
from blackboard.robot.service import FORGET
from fleet_manager.client.client import ANSWER_WITHIN
from fleet_manager.client.formats import UNKNOWN, counted, percent
from fleet_manager.client.tables import aligned
from fleet_manager.errors import NotDoneError
from hive_common.structuring import NotAllowedError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from blackboard.costing.saved_experience import SavedExperience
    from blackboard.costing.track_record import Outcome
    from fleet_manager.client.client import HiveClient

BLOCK = 20
"""The error over time is told for so many tasks each."""

FORMULA = "bids by the formula"

_MINUTE = 60.0  # length of the task by which margins of time are told [s]
_DISTANCE, _TURNING = 10.0, math.pi  # the drive of which shares are told [m, rad]
_WHOLE_FROM = 9.95  # a number from here on is written without decimals
_MOST_SHOWN = 1e6  # a larger number tells a person nothing

_HEAD = (
    *("ROBOT", "DRIVES", "TASKS", "TIME OFF BY", "ENERGY OFF BY"),
    *("TIME MARGIN", "ENERGY MARGIN", "CLIPPED", "REMARK"),
)
_BLOCK_HEAD = (
    *("TASKS", "TIME OFF BY", "19 OF 20", "ENERGY OFF BY", "19 OF 20"),
    *("TIME KEPT", "ENERGY KEPT"),
)
_PACE_HEAD = ("A DRIVE TAKES", "", "OF 10 m WITH A HALF TURN IN ALL")
_SHARE_HEAD = ("LEARNED SHARE", "OF THE FORMULA")


def read_learned(robot: str, content: object) -> SavedExperience:
    """Return what the content of a robot's parameter `learned` says.

    Raises:
        NotDoneError: It says nothing, or cannot be used.
    """
    if content is None:
        raise NotDoneError(
            f"nothing is known of what {robot} has learned: it has no parameter `learned`, as "
            "robots of other makes have none"
        )
    try:
        return saved_from(content)
    except NotAllowedError as error:
        raise NotDoneError(
            f"{robot}'s parameter `learned` cannot be used: {_one_line(str(error))}"
        ) from None


def have_forget(client: HiveClient, robot: str) -> None:
    """Have a robot that was fetched forget what it has learned, and wait until it tells so.

    Raises:
        NoHiveError: The ROS master no longer answers.
        NotDoneError: The robot does not tell so.
    """
    before = _extent(client, robot)

    def has_forgotten() -> bool:
        now = _extent(client, robot)
        return now is not None and (not any(now) or (before is not None and now < before))

    if not client.tell(robot, FORGET, has_forgotten, is_so=has_forgotten()):
        raise NotDoneError(
            f"{robot} has not told within {ANSWER_WITHIN:g} s that it has forgotten; its log says "
            "why. Try again; a robot of an earlier version or of another make does not know the "
            f"word `{FORGET}`"
        )


def what_is_lost(robot: str, content: object) -> list[str]:
    """Return in words what becomes of what a robot has learned if it forgets; none if nothing."""
    try:
        saved = read_learned(robot, content)
    except NotDoneError as error:
        return [f"{error}; it forgets whatever it has learned"]
    drives, tasks = Learned(*saved.learned).drives, len(saved.outcomes)
    if not (drives or tasks):
        return []
    went = f"how its last {counted(tasks, 'task')} went"
    return [f"{robot} forgets what it has learned from {_drives(drives)}, and {went}"]


def _extent(client: HiveClient, robot: str) -> tuple[float, int] | None:
    """Return how many drives and tasks a robot tells of; None if it tells nothing of use."""
    try:
        saved = read_learned(robot, client.link.learned_of(robot))
    except NotDoneError:
        return None
    return Learned(*saved.learned).drives, len(saved.outcomes)


def learned_table(known: Mapping[str, SavedExperience | str]) -> list[str]:
    """Return a table with a line for each robot; a text says why nothing is known of one."""
    nothing = [UNKNOWN] * (len(_HEAD) - 2)
    rows = [
        (robot, *nothing, each) if isinstance(each, str) else _robot_row(robot, each)
        for robot, each in known.items()
    ]
    return aligned(_HEAD, rows)


def _robot_row(robot: str, saved: SavedExperience) -> tuple[str, ...]:
    learned, tasks = Learned(*saved.learned), saved.tasks
    late, more = _margins(learned)
    errors = (_time_errors(tasks), _energy_errors(tasks))
    off_by = [_compared(map(median, each)) if tasks else UNKNOWN for each in errors]
    changes = [_one_line(each) for each in saved.changes[-1:]]
    remarks = [*([] if learned.drives > 0 else [FORMULA]), *changes]
    return (
        robot,
        str(round(learned.drives)),
        str(len(tasks)),
        *off_by,
        f"{late} of 60 s",
        more,
        str(saved.clipped),
        "; ".join(remarks),
    )


def robot_lines(robot: str, saved: SavedExperience) -> list[str]:
    """Return all that a person may want to know of what one robot has learned."""
    learned, tasks = Learned(*saved.learned), saved.tasks
    late, more = _margins(learned)
    by = f"bids by what it has learned from {_drives(learned.drives)}"
    lines = [
        f"{robot} {by if learned.drives > 0 else FORMULA}",
        f"nine of ten tasks that are predicted to take 60 s take at most {late} longer",
        f"nine of ten tasks draw at most {more} more energy than predicted",
        "",
    ]
    if tasks:
        rows = [_block_row(tasks, first) for first in range(0, len(tasks), BLOCK)]
        lines += aligned(_BLOCK_HEAD, rows)
    else:
        lines += ["it has finished no task since it began to learn"]
    if learned.drives > 0:
        lines += ["", *_pace_table(learned), "", *_share_table(learned)]
    lines += ["", f"predictions that were clipped: {saved.clipped}"]
    changes = [f"  {_one_line(each)}" for each in saved.changes]
    return [*lines, *(["changes noticed:", *changes] if changes else ["no change was noticed"])]


def _block_row(tasks: Sequence[Outcome], first: int) -> tuple[str, ...]:
    """Return the errors of the tasks of a block, by the formula and as learned."""
    block = tasks[first : first + BLOCK]
    time, energy = _time_errors(block), _energy_errors(block)
    return (
        f"{first + 1}–{first + len(block)}",
        _compared(map(median, time)),
        _compared(map(_most, time)),
        _compared(map(median, energy)),
        _compared(map(_most, energy)),
        percent(sum(each.time <= each.most_time for each in block) / len(block)),
        percent(sum(each.energy <= each.most_energy for each in block) / len(block)),
    )


def _pace_table(learned: Learned) -> list[str]:
    parts = (
        ("in any case", f"{learned.per_drive:.2f} s", learned.per_drive),
        ("for its length", f"{learned.per_metre:.2f} s/m", learned.per_metre * _DISTANCE),
        ("for turning", f"{learned.per_radian:.2f} s/rad", learned.per_radian * _TURNING),
    )
    total = sum(seconds for _, _, seconds in parts)
    rows = [
        (name, pace, f"{_number(seconds)} s, {percent(seconds / total if total else math.nan)}")
        for name, pace, seconds in parts
    ]
    return aligned(_PACE_HEAD, rows)


def _share_table(learned: Learned) -> list[str]:
    return aligned(
        _SHARE_HEAD,
        [
            ("energy of friction", percent(learned.friction)),
            ("energy of electronics and arm", percent(learned.power)),
            ("time of the arm for a pick", percent(learned.pick)),
            ("time of the arm for a place", percent(learned.place)),
        ],
    )


def _margins(learned: Learned) -> tuple[str, str]:
    """Return how much more nine of ten tasks take at most than predicted: time and energy."""
    late = _number(learned.time_margin * math.sqrt(_MINUTE))
    return f"{late} s", _error(learned.energy_margin)


def _time_errors(tasks: Iterable[Outcome]) -> tuple[list[float], list[float]]:
    """Return by which share times were predicted wrongly: by the formula, and as learned."""
    return (
        [abs(each.formula_time / each.time - 1.0) for each in tasks],
        [abs(each.predicted_time / each.time - 1.0) for each in tasks],
    )


def _energy_errors(tasks: Iterable[Outcome]) -> tuple[list[float], list[float]]:
    """Return the same of energies."""
    return (
        [abs(each.formula_energy / each.energy - 1.0) for each in tasks],
        [abs(each.predicted_energy / each.energy - 1.0) for each in tasks],
    )


def _most(errors: Sequence[float]) -> float:
    """Return the 95th percentile."""
    if len(errors) == 1:
        return errors[0]
    return quantiles(errors, n=20, method="inclusive")[-1]


def _drives(number: float) -> str:
    """Return a number of drives, which is a mean where others have learned too."""
    return counted(round(number), "drive")


def _compared(figures: Iterable[float]) -> str:
    """Return an error by the formula, and as learned."""
    formula, learned = map(_error, figures)
    return f"{formula} → {learned}"


def _error(share: float) -> str:
    number = _number(share * 100.0)
    return number if number == UNKNOWN else f"{number} %"


def _number(value: float) -> str:
    """Return a number with two digits, or one if it is below 1; nothing if it is beyond all."""
    if not abs(value) < _MOST_SHOWN:
        return UNKNOWN
    return f"{value:.1f}" if abs(value) < _WHOLE_FROM else f"{value:.0f}"


def _one_line(text: str) -> str:
    """Return a text that others wrote without line breaks and control characters."""
    return " ".join("".join(each if each.isprintable() else " " for each in text).split())
