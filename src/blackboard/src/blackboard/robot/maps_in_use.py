# SPDX-License-Identifier: BSD-3-Clause
"""Which maps the parts of a robot use, and whether that is the leader's.

Where a robot plans or localizes on another map than the rest of the hive, places and ways mean
something else to it. Such a robot says so, and bids on nothing.
"""

from __future__ import annotations

from hive_common.map_id import NO_MAP, MapId

_MOST_PARTS = 16


class MapsInUse:
    """The maps of one robot, by the part that uses each."""

    def __init__(self) -> None:
        self._used: dict[str, MapId] = {}
        self._names: dict[str, str] = {}

    def note(self, part: str, used: MapId) -> None:
        """Note which map a part uses from now on; who knows the name of a map tells it to all.

        Parts beyond the first few are passed over: no robot has so many.
        """
        if part not in self._used and len(self._used) >= _MOST_PARTS:
            return
        self._used[part] = used
        if used.name:
            self._names[used.checksum] = used.name

    def told(self, leaders: MapId) -> MapId:
        """Return the map to tell: the first that is not the leader's, else the first of all."""
        known = (used for used in self._used.values() if used.checksum)
        used = self._odd(leaders) or next(known, NO_MAP)
        return self._named(used)

    def trouble(self, leaders: MapId) -> str:
        """Return in words which map is not the leader's; empty if all are, or none is known."""
        odd = self._odd(leaders)
        if odd is None:
            return ""
        parts = [part for part, used in self._used.items() if used.checksum == odd.checksum]
        who = f"its {' and '.join(parts)} {'uses' if len(parts) == 1 else 'use'}"
        return f"{who} {self._named(odd)}, and the leader uses {self._named(leaders)}"

    def _odd(self, leaders: MapId) -> MapId | None:
        return next((used for used in self._used.values() if used.differs(leaders)), None)

    def _named(self, used: MapId) -> MapId:
        return used._replace(name=used.name or self._names.get(used.checksum, ""))
