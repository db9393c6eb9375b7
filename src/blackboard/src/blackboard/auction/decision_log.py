# SPDX-License-Identifier: BSD-3-Clause
"""Where a member keeps the decisions that auctions made while it led.

The file lies beside the journal. It is neither replicated nor forced to disk: the task list tells
who has won; this only tells why, and may lose its last lines in a power cut.
"""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing, suppress
from operator import attrgetter
from typing import TYPE_CHECKING

from blackboard.auction.decision import from_plain
from blackboard.consensus.journal import fields_of
from blackboard.errors import JournalError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from blackboard.auction.decision import Decision

ENDING = ".auctions.sqlite3"
"""End of the files' names."""

MAX_SIZE = 100_000_000
"""Size of a file, but for what SQLite writes beside it [B]; older decisions are deleted.

A decision takes about 600 B for each robot that has bid.
"""

_AT_ONCE = 50
"""The part of a full file that is deleted is one in so many decisions."""

_TABLE = """
CREATE TABLE IF NOT EXISTS decisions
    (number INTEGER PRIMARY KEY AUTOINCREMENT, task TEXT NOT NULL, decision TEXT NOT NULL);
CREATE INDEX IF NOT EXISTS by_task ON decisions (task);
"""


class SqliteBook:
    """Keeps decisions in a file; it and its folder are created if missing.

    Raises:
        JournalError: The file can neither be read nor created.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._database = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
            self._database.execute("PRAGMA journal_mode = WAL")
            self._database.execute("PRAGMA synchronous = OFF")
            self._database.executescript(_TABLE)
        except (OSError, sqlite3.Error) as error:
            raise self._failed(error) from None

    def note(self, decisions: Iterable[Decision]) -> None:
        """Keep decisions.

        Raises:
            JournalError: They cannot be written; the text says why and where.
        """
        rows = [(each.task_id, json.dumps(each, default=fields_of)) for each in decisions]
        if not rows:
            return
        try:
            self._database.execute("BEGIN")
            self._database.executemany(
                "INSERT INTO decisions (task, decision) VALUES (?, ?)", rows
            )
            while self._used() > MAX_SIZE and self._delete_oldest():
                pass
            self._database.execute("COMMIT")
        except sqlite3.Error as error:
            with suppress(sqlite3.Error):
                self._database.execute("ROLLBACK")
            raise self._failed(error) from None

    def _used(self) -> int:
        """Return how much of the file is in use [B]."""
        pages, free, size = (
            int(self._database.execute(f"PRAGMA {name}").fetchone()[0])
            for name in ("page_count", "freelist_count", "page_size")
        )
        return (pages - free) * size

    def _delete_oldest(self) -> int:
        """Return how many decisions were deleted; the last one stays."""
        return self._database.execute(
            "DELETE FROM decisions WHERE number < (SELECT max(number) FROM decisions) AND number "
            "<= (SELECT min(number) + (max(number) - min(number)) / ? FROM decisions)",
            (_AT_ONCE,),
        ).rowcount

    def close(self) -> None:
        """Close the file."""
        self._database.close()

    def _failed(self, error: Exception) -> JournalError:
        return JournalError(
            f"{self._path} cannot be used: {error}; free the disk or name another folder with the "
            "parameter journal"
        )


def read_decisions(folder: Path, task_id: str) -> list[Decision]:
    """Return the decisions about a task in all files of a folder, oldest first.

    Raises:
        JournalError: A file cannot be read.
    """
    found: list[Decision] = []
    for path in sorted(folder.glob(f"*{ENDING}")):
        try:
            with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as database:
                texts = database.execute(
                    "SELECT decision FROM decisions WHERE task = ? ORDER BY number", (task_id,)
                ).fetchall()
            found += [from_plain(json.loads(text)) for (text,) in texts]
        except (sqlite3.Error, ValueError, KeyError, TypeError) as error:
            raise JournalError(f"{path} cannot be read: {error}") from None
    return sorted(found, key=attrgetter("number"))
