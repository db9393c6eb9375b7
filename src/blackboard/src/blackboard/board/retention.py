# SPDX-License-Identifier: BSD-3-Clause
"""Which ended tasks the hive forgets, so that the task list does not grow for ever.

The leader counts the time since a task ended by its own clock, from its election at the earliest:
nobody knows for certain how long its predecessor has seen the task ended. So a takeover keeps
ended tasks longer, never shorter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.consensus.log import Log
    from blackboard.domain.record import TaskRecord

MIN_KEPT = 10.0
"""However many have ended, each is kept for this long [s]: whoever posted it and heard no answer
posts it again within this time, and it must not be taken for a new task then."""

MAX_AT_ONCE = 1000
"""Tasks forgotten by one change, more only if they are parts of one task; the rest follows."""


class Retention:
    """Remembers when tasks ended.

    A task that was split is forgotten together with its parts, once all of them have ended.

    Args:
        keep: Ended tasks are kept for this long [s].
        max_ended: Of more ended tasks than this, the oldest are forgotten earlier.
    """

    def __init__(self, keep: float, max_ended: int) -> None:
        self._keep = keep
        self._max_ended = max_ended
        self._endings: dict[str, tuple[float, int]] = {}  # when seen [s], and in which version

    def begin(self) -> None:
        """Count from now on: the hive may have dropped what was seen before."""
        self._endings.clear()

    def due(self, log: Log, now: float) -> tuple[str, ...]:
        """Return the ids of tasks to be forgotten now [s]; their ends are committed."""
        families = ended_families(log.latest.records)
        known, new = self._endings, (now, log.position.version)
        self._endings = {whole: known.get(whole, new) for whole in families}
        left = sum(map(len, families.values()))
        found: list[str] = []
        for whole in sorted(families, key=lambda name: self._endings[name][0]):
            seen, version = self._endings[whole]
            age = now - seen
            too_many = left > self._max_ended and age >= MIN_KEPT
            if (age < self._keep and not too_many) or len(found) >= MAX_AT_ONCE:
                break
            if version <= log.committed:
                left -= len(families[whole])
                found += families[whole]
                del self._endings[whole]
        return tuple(found)


def ended_families(records: Mapping[str, TaskRecord]) -> dict[str, list[str]]:
    """Return the ids of each whole task and its parts, if all have ended, the oldest first."""
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
