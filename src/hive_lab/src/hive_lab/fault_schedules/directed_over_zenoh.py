# SPDX-License-Identifier: BSD-3-Clause
"""The schedules written by hand, for a hive over Zenoh."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from hive_lab.fault_schedules.directed import DIRECTED
from hive_lab.fault_schedules.schedule import Site

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hive_lab.fault_schedules.schedule import FaultSchedule

_SEEDS: Mapping[str, int] = MappingProxyType(
    {
        "a late start": 187,
        "a needless election": 1,
        "a restarted drive": 61,
        "a restarted voter": 2,
        "an old answer": 91,
        "late vote": 7,
        "recovered beside a majority": 4,
    }
)
"""Of the small delays, where the moment that a schedule is written for comes with others only."""

_SITES: Mapping[str, Site] = MappingProxyType({"a late start": Site(twice=True)})
"""That schedule needs a message that arrives again later: through a second router."""

OVER_ZENOH: Mapping[str, FaultSchedule] = MappingProxyType(
    {
        name: replace(
            schedule, seed=_SEEDS.get(name, schedule.seed), site=_SITES.get(name, Site())
        )
        for name, schedule in DIRECTED.items()
    }
)
"""By the names in `DIRECTED`. No connection fails but as the schedule says."""
