# SPDX-License-Identifier: BSD-3-Clause
"""What a robot has learned as plain data, which journals and the parameter server hold."""

from typing import Annotated

import attrs
import numpy as np
from numpy.typing import NDArray

from blackboard.costing.experience import Learned
from blackboard.costing.track_record import KEPT, Outcome
from hive_common.structuring import Allowed, NotAllowedError, between, each_within, structure

TIMES, SHARES = 3, 2
"""How many numbers of `Learned` are learned together: those of drives, and those of energy."""

CHANGES_KEPT = 10
_ROUNDING = 1e-6
_MOST = 1e10  # also in seconds since 1970

_Count = Annotated[int, between(0, 1e9, "a number of drives")]


def _square(size: int) -> Allowed:
    def check(rows: tuple[tuple[float, ...], ...]) -> bool:
        if not rows:
            return True
        table = np.array(rows) if {len(rows), *map(len, rows)} == {size} else np.full((1, 1), -1.0)
        is_small = bool((np.abs(table) <= _MOST).all())
        return is_small and np.allclose(table, table.T) and _is_covariance(table)

    return Allowed(f"a covariance, {size} rows of {size} numbers, or none", check)


def _is_covariance(table: NDArray[np.float64]) -> bool:
    """Return whether no variance is below 0, but for rounding."""
    return bool(np.linalg.eigvalsh(table).min() >= -_ROUNDING * np.abs(table).max())


_Row = Annotated[tuple[float, ...], each_within(_MOST, f"{len(Outcome._fields)} numbers")]


@attrs.frozen(kw_only=True)
class SavedExperience:
    """What a robot has learned.

    Raises:
        NotAllowedError: A list has another length than it should.
    """

    learned: Annotated[tuple[float, ...], each_within(_MOST, f"{len(Learned._fields)} numbers")]
    """A `Learned`."""
    of_time: Annotated[tuple[tuple[float, ...], ...], _square(TIMES)] = ()
    """How well its times are known; see `Regression.covariance`."""
    of_energy: Annotated[tuple[tuple[float, ...], ...], _square(SHARES)] = ()
    """How well its shares of energy are known."""
    clipped: _Count = 0
    """So many were predicted outside of the limits."""
    outcomes: tuple[_Row, ...] = ()
    """Each an `Outcome`, oldest first."""
    settled: Annotated[int, between(-KEPT, 1e9, "a number of tasks")] = 0
    """See `TrackRecord.settled`."""
    changes: tuple[str, ...] = ()
    """What has changed, in words, oldest first."""

    def __attrs_post_init__(self) -> None:
        if len(self.learned) != len(Learned._fields):
            found, allowed = len(self.learned), len(Learned._fields)
            raise NotAllowedError(("learned",), f"has {found} numbers; allowed: {allowed}")
        for number, each in enumerate(self.outcomes):
            if len(each) != len(Outcome._fields):
                text = f"has {len(each)} numbers; allowed: {len(Outcome._fields)}"
                raise NotAllowedError(("outcomes", number), text)

    @property
    def tasks(self) -> tuple[Outcome, ...]:
        """The last tasks of which something can be said."""
        found = (Outcome(*each) for each in self.outcomes[-KEPT:])
        return tuple(each for each in found if each.is_usable)


def saved_from(content: object) -> SavedExperience:
    """Return what plain data holds; raise NotAllowedError for its first mistake."""
    return structure(content, SavedExperience)


def as_plain(saved: SavedExperience) -> dict[str, object]:
    """Return it as plain data, which `saved_from` reads."""
    return attrs.asdict(saved)
