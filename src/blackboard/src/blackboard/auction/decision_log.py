# SPDX-License-Identifier: BSD-3-Clause
"""Where a member keeps what auctions have decided while it carried the blackboard.

A file of its own beside the journal, not replicated and not forced to disk: who has won is in the
task list; this only says why, and may lose its last lines in a power cut.
"""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing, suppress
from typing import TYPE_CHECKING, Protocol

from blackboard.auction.decision import from_plain
from blackboard.consensus.journal import fields_of
from blackboard.errors import JournalError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from blackboard.auction.decision import Decision

ENDING = ".auctions.sqlite3"
"""Of the files' names."""

MAX_KEPT = 20_000
"""Decisions in a file; the oldest make way."""

_TABLE = """
CREATE TABLE IF NOT EXISTS decisions
    (number INTEGER PRIMARY KEY AUTOINCREMENT, task TEXT NOT NULL, decision TEXT NOT NULL);
CREATE INDEX IF NOT EXISTS by_task ON decisions (task);
"""


class DecisionBook(Protocol):
    """Keeps decisions."""

    def note(self, decisions: Iterable[Decision]) -> None:
        """Write decisions down.

        Raises:
            JournalError: They cannot be written; the text says why and where.
        """


class MemoryBook:
    """Keeps decisions in a list, for tests and simulations.

    Attributes:
        decisions: All of them, oldest first.
    """

    def __init__(self) -> None:
        self.decisions: list[Decision] = []

    def note(self, decisions: Iterable[Decision]) -> None:
        """Write decisions down."""
        self.decisions.extend(decisions)


class NoBook:
    """Keeps nothing."""

    def note(self, decisions: Iterable[Decision]) -> None:
        """Write nothing down."""


class SqliteBook:
    """Keeps decisions in a file.

    Args:
        path: The file; its folder is made where it does not exist.

    Raises:
        JournalError: The file can neither be read nor made.
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
        """Write decisions down."""
        rows = [(each.task_id, json.dumps(each, default=fields_of)) for each in decisions]
        if not rows:
            return
        try:
            self._database.execute("BEGIN")
            self._database.executemany(
                "INSERT INTO decisions (task, decision) VALUES (?, ?)", rows
            )
            self._database.execute(
                "DELETE FROM decisions WHERE number <= (SELECT max(number) FROM decisions) - ?",
                (MAX_KEPT,),
            )
            self._database.execute("COMMIT")
        except sqlite3.Error as error:
            with suppress(sqlite3.Error):
                self._database.execute("ROLLBACK")
            raise self._failed(error) from None

    def close(self) -> None:
        """Let go of the file."""
        self._database.close()

    def _failed(self, error: Exception) -> JournalError:
        return JournalError(
            f"{self._path} cannot be used: {error}; free the disk or name another folder with the "
            "parameter journal"
        )


def read_decisions(folder: Path, task_id: str) -> list[Decision]:
    """Return what all members whose files lie in a folder have decided about a task, oldest first.

    Raises:
        JournalError: A file is there and cannot be read.
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
    return sorted(found, key=lambda each: (each.epoch, each.auction, each.round))
