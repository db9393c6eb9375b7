# SPDX-License-Identifier: BSD-3-Clause
"""A change of the program, and the schedule that notices it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import pytest

from hive_lab.fault_schedules.directed import DIRECTED
from hive_lab.fault_schedules.directed_over_zenoh import OVER_ZENOH
from hive_lab.fault_schedules.draw import draw
from hive_lab.fault_schedules.run import run

if TYPE_CHECKING:
    from collections.abc import Callable

    from hive_lab.fault_schedules.schedule import FaultSchedule


def _nothing(_: pytest.MonkeyPatch) -> None:
    """Change nothing."""


@dataclass(frozen=True)
class Mutation:
    """A change of the program that breaks a property of the protocol.

    Attributes:
        change: Makes the change; its name is that of the mutation.
        noticed_by: A schedule that breaks a property with the change and none without it: the name
            of one that was written by hand, or a seed and the scenario in which it is drawn.
        bug: The schedule that once found this mistake in the program, as docs/protocol.md calls
            it; empty for a rule that has always been there.
        given: Changed as well, with the mutation and without it.
        over_zenoh: The seed of the schedule that notices it over Zenoh, which is drawn in the same
            scenario; of no effect for one that was written by hand, which is the same. None if no
            schedule over Zenoh is known that does.
    """

    change: Callable[[pytest.MonkeyPatch], None]
    noticed_by: str | tuple[int, str]
    bug: str = ""
    given: Callable[[pytest.MonkeyPatch], None] = _nothing
    over_zenoh: int | None = 0

    @property
    def name(self) -> str:
        """What the program does, in words."""
        return self.change.__name__.replace("_", " ")

    @property
    def where(self) -> str:
        """The schedule that notices it, as the arguments of `fault_schedules.run` name it."""
        known = self.noticed_by
        return known if isinstance(known, str) else " ".join(map(str, known)).strip()

    @property
    def scenario(self) -> str:
        """The scenario in which schedules are drawn that notice it; empty for any."""
        return "" if isinstance(self.noticed_by, str) else self.noticed_by[1]

    @property
    def schedule(self) -> FaultSchedule:
        """The schedule that notices it."""
        known = self.noticed_by
        return DIRECTED[known] if isinstance(known, str) else draw(*known)

    @property
    def schedule_over_zenoh(self) -> FaultSchedule | None:
        """The schedule that notices it over Zenoh."""
        known = self.noticed_by
        if self.over_zenoh is None:
            return None
        if isinstance(known, str):
            return OVER_ZENOH[known]
        return draw(self.over_zenoh, self.scenario, zenoh=True)

    def broken_in(self, schedule: FaultSchedule) -> str:
        """Return the property that the changed program breaks in a schedule, and how."""
        return self._run(schedule, changed=True)

    def broken_without(self, schedule: FaultSchedule) -> str:
        """Return the property that the program breaks in a schedule without the change."""
        return self._run(schedule, changed=False)

    def _run(self, schedule: FaultSchedule, *, changed: bool) -> str:
        with pytest.MonkeyPatch.context() as patch:
            self.given(patch)
            if changed:
                self.change(patch)
            return run(schedule).violation
