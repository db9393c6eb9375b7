# SPDX-License-Identifier: BSD-3-Clause
"""Which ended tasks the list may do without, so that it does not grow for ever.

The active blackboard counts how long each has ended by its own clock, and from its own beginning
on: how long a predecessor has seen it ended nobody knows for certain, so a takeover keeps what has
ended for longer, never for shorter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.consensus.log import Log
    from blackboard.domain.record import TaskRecord

SHORTEST = 10.0
"""However many have ended, each is kept for that long [s]: whoever has posted it and heard no
answer posts it again within this time, and it must not be taken for a new task then."""

MAX_AT_ONCE = 1000
"""Tasks that one change forgets, more only where they are the parts of one; the rest follows."""


@dataclass(frozen=True, slots=True)
class _Ending:
    """When a task was first seen to have ended, and the version of the list that says so."""

    seen: float
    version: int


class Retention:
    """Remembers since when tasks have ended.

    A task that was split is forgotten together with its parts, when all of them have ended.

    Args:
        keep: What has ended is kept for this long [s].
        most: Of more that have ended than this the oldest are forgotten earlier.
    """

    def __init__(self, keep: float, most: int) -> None:
        self._keep = keep
        self._most = most
        self._endings: dict[str, _Ending] = {}

    def begin(self) -> None:
        """Count from now on: what was seen before may have been given up by the hive."""
        self._endings.clear()

    def due(self, log: Log, now: float) -> tuple[str, ...]:
        """Return the ids of what is to be forgotten now; that they have ended is committed.

        Args:
            log: The list.
            now: The time [s].
        """
        families = ended_families(log.latest.records)
        known, first_seen = self._endings, _Ending(now, log.position.version)
        self._endings = {whole: known.get(whole, first_seen) for whole in families}
        left = sum(map(len, families.values()))
        found: list[str] = []
        for whole in sorted(families, key=lambda name: self._endings[name].seen):
            ending = self._endings[whole]
            age = now - ending.seen
            too_many = left > self._most and age >= SHORTEST
            if (age < self._keep and not too_many) or len(found) >= MAX_AT_ONCE:
                break
            if ending.version <= log.committed:
                left -= len(families[whole])
                found += families[whole]
                del self._endings[whole]
        return tuple(found)


def ended_families(records: Mapping[str, TaskRecord]) -> dict[str, list[str]]:
    """Return the ids of each task that was not split off another and of all its parts.

    Those are left out of which something has not ended. The oldest posted come first.
    """
    families: dict[str, list[str]] = {}
    unfinished = set()
    for task_id, record in records.items():
        whole = record
        while whole.parent in records:
            whole = records[whole.parent]
        families.setdefault(whole.task.id, []).append(task_id)
        if not record.state.is_terminal:
            unfinished.add(whole.task.id)
    return {name: family for name, family in families.items() if name not in unfinished}
