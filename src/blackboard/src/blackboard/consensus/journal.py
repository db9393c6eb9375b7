# SPDX-License-Identifier: BSD-3-Clause
"""The disk of a member: its hard state, and a robot's open reports and loads, as JSON.

A member writes here before it sends anything that others rely on. `SqliteJournal` survives a power
cut; `MemoryJournal` serves simulations, and survives a crash of its member.
"""

from __future__ import annotations

import contextlib
import json
import sqlite3
import time
from contextlib import closing
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from blackboard.consensus.log import Entry, Log, Position, Snapshot
from blackboard.domain.charger import Grant
from blackboard.domain.record import Hold, Load, TaskRecord, TaskUpdate
from blackboard.domain.task import Task, TaskState
from blackboard.errors import JournalError
from hive_common.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from pathlib import Path


@dataclass(frozen=True, slots=True)
class HardState:
    """What a member has to remember after a restart (Raft's persistent state)."""

    member: str  # its id
    epoch: int  # the highest epoch it has seen
    vote: str  # id of the candidate it voted for in this epoch; empty if it has not voted
    log: Log
    hive: str = ""  # id of its hive; empty while it belongs to none


class Journal(Protocol):
    """The disk of one member."""

    def load(self) -> HardState | None:
        """Return the hard state written last, or None if there is none.

        Raises:
            JournalError: It cannot be read.
        """

    def save(self, hard_state: HardState) -> None:
        """Write the hard state; once this returns, a power cut does not lose it.

        Raises:
            JournalError: It cannot be written; the text says why and where.
        """

    def load_reports(self) -> tuple[TaskUpdate, ...]:
        """Return the reports that the blackboard has not acknowledged."""

    def save_reports(self, reports: Iterable[TaskUpdate]) -> None:
        """Replace the reports that the blackboard has not acknowledged; raises as `save` does."""

    def load_hold(self) -> Hold:
        """Return what may be on board of the robot."""

    def save_hold(self, hold: Hold) -> None:
        """Replace what may be on board of the robot; raises as `save` does."""

    def load_experience(self) -> object:
        """Return what the robot has learned, as plain data; None if nothing was saved."""

    def save_experience(self, content: object) -> None:
        """Replace what the robot has learned, plain data; raises as `save` does."""

    def load_home(self) -> Pose | None:
        """Return where the robot goes from a charger [map frame]; None if nothing was saved."""

    def save_home(self, home: Pose) -> None:
        """Replace where the robot goes from a charger; raises as `save` does."""


@dataclass
class MemoryJournal:
    """A disk for simulations and tests."""

    hard_state: HardState | None = None
    reports: tuple[TaskUpdate, ...] = field(default=())
    hold: Hold = field(default_factory=Hold)
    experience: object = None
    home: Pose | None = None

    def load(self) -> HardState | None:
        """Return the hard state written last."""
        return self.hard_state

    def save(self, hard_state: HardState) -> None:
        """Keep the hard state."""
        self.hard_state = hard_state

    def load_reports(self) -> tuple[TaskUpdate, ...]:
        """Return the unacknowledged reports."""
        return self.reports

    def save_reports(self, reports: Iterable[TaskUpdate]) -> None:
        """Replace the unacknowledged reports."""
        self.reports = tuple(reports)

    def load_hold(self) -> Hold:
        """Return what may be on board."""
        return self.hold

    def save_hold(self, hold: Hold) -> None:
        """Replace what may be on board."""
        self.hold = hold

    def load_experience(self) -> object:
        """Return what the robot has learned."""
        return self.experience

    def save_experience(self, content: object) -> None:
        """Replace what the robot has learned."""
        self.experience = content

    def load_home(self) -> Pose | None:
        """Return where the robot goes from a charger."""
        return self.home

    def save_home(self, home: Pose) -> None:
        """Replace where the robot goes from a charger."""
        self.home = home


_Read = TypeVar("_Read")
_LOCK_TIME = 1.0  # that a program waits for others which have a journal open [s]
_FORMAT = 2
_APPLICATION = 0x48495645
_HOLD = "CREATE TABLE IF NOT EXISTS hold (one INTEGER PRIMARY KEY, hold TEXT NOT NULL)"
_EXPERIENCE = (
    "CREATE TABLE IF NOT EXISTS experience (one INTEGER PRIMARY KEY, experience TEXT NOT NULL)"
)
_HOME = "CREATE TABLE IF NOT EXISTS home (one INTEGER PRIMARY KEY, home TEXT NOT NULL)"
_TABLES = f"""
CREATE TABLE self (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE records
    (task TEXT PRIMARY KEY, place INTEGER NOT NULL, record TEXT NOT NULL);
CREATE TABLE entries (version INTEGER PRIMARY KEY, entry TEXT NOT NULL);
CREATE TABLE reports (task TEXT PRIMARY KEY, report TEXT NOT NULL);
PRAGMA application_id = {_APPLICATION};
PRAGMA user_version = {_FORMAT};
"""


class SqliteJournal:
    """A file that survives a power cut (SQLite, write-ahead log, every commit on disk).

    A file that is damaged or has another format is never overwritten, but renamed, with the time
    in its new name. A file that is whole, and has a task that this version cannot use, stays where
    it is: another version can read it, and its member has promised to keep it.

    Args:
        path: The file; missing folders are created.
        alone: Whether no member may have the file open before `close`. Then the file has to exist
            and to be whole.

    Attributes:
        set_aside: New path of an unreadable file; None if there was none.

    Raises:
        JournalError: The file can be neither read, nor created, nor renamed, or has a task that
            this version cannot use; the text names the task. Or a member has it open.
    """

    def __init__(self, path: Path, *, alone: bool = False) -> None:
        self._path = path
        self._saved: HardState | None = None
        self.set_aside: Path | None = None
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            try:
                self._database = _open_alone(path) if alone else self._open()
                self._saved = self._read()
                self.load_reports()
                self.load_hold()
                self.load_experience()
                self.load_home()
            except JournalError:
                self._database.close()
                raise
            except (sqlite3.DatabaseError, ValueError, KeyError, TypeError) as error:
                self._close_if_open()
                if alone:
                    raise _not_changed(path, error) from None
                if _is_locked(error):
                    raise _in_use(path) from None
                self._move_away()
                self._database = self._open()
        except (OSError, sqlite3.Error) as error:
            raise self._failed(error) from None

    def load(self) -> HardState | None:
        """Return the hard state written last."""
        return self._saved

    def save(self, hard_state: HardState) -> None:
        """Write what has changed since the last time, in one transaction."""
        before, log = self._saved, hard_state.log
        with self._transaction():
            self._write_self(before, hard_state)
            # Entries of another hive may have the same positions.
            if before is None or before.hive != hard_state.hive or not _continues(before.log, log):
                self._database.execute("DELETE FROM records")
                self._database.execute("DELETE FROM entries")
                self._write_records(log.base.records.values())
                self._write_entries(log.entries)
            elif before.log is not log:
                self._write_changes(before.log, log)
        self._saved = hard_state

    def load_reports(self) -> tuple[TaskUpdate, ...]:
        """Return the unacknowledged reports."""
        rows = self._database.execute("SELECT task, report FROM reports ORDER BY rowid")
        return tuple(self._usable(_report, task, json.loads(text)) for task, text in rows)

    def save_reports(self, reports: Iterable[TaskUpdate]) -> None:
        """Replace the unacknowledged reports."""
        rows = [(report.task_id, to_json(report)) for report in reports]
        with self._transaction():
            self._database.execute("DELETE FROM reports")
            self._database.executemany("INSERT INTO reports VALUES (?, ?)", rows)

    def load_hold(self) -> Hold:
        """Return what may be on board."""
        row = self._database.execute("SELECT hold FROM hold").fetchone()
        return Hold() if row is None else _hold(json.loads(row[0]))

    def save_hold(self, hold: Hold) -> None:
        """Replace what may be on board."""
        with self._transaction():
            self._database.execute("INSERT OR REPLACE INTO hold VALUES (1, ?)", (to_json(hold),))

    def load_experience(self) -> object:
        """Return what the robot has learned."""
        row = self._database.execute("SELECT experience FROM experience").fetchone()
        return None if row is None else json.loads(row[0])

    def save_experience(self, content: object) -> None:
        """Replace what the robot has learned."""
        with self._transaction():
            row = (json.dumps(content),)
            self._database.execute("INSERT OR REPLACE INTO experience VALUES (1, ?)", row)

    def load_home(self) -> Pose | None:
        """Return where the robot goes from a charger."""
        row = self._database.execute("SELECT home FROM home").fetchone()
        return None if row is None else _home(json.loads(row[0]))

    def save_home(self, home: Pose) -> None:
        """Replace where the robot goes from a charger."""
        with self._transaction():
            row = (json.dumps(home._asdict()),)
            self._database.execute("INSERT OR REPLACE INTO home VALUES (1, ?)", row)

    def close(self) -> None:
        """Close the file."""
        self._database.close()

    def _open(self) -> sqlite3.Connection:
        is_new = not self._path.exists() or self._path.stat().st_size == 0
        database = sqlite3.connect(self._path, isolation_level=None, check_same_thread=False)
        try:
            _check_whole(database, is_new=is_new)
            database.execute("PRAGMA journal_mode = WAL")
            database.execute("PRAGMA synchronous = FULL")
            if is_new:
                database.executescript(f"BEGIN;{_TABLES}COMMIT;")
            # Journals of older versions lack these.
            database.execute(_HOLD)
            database.execute(_EXPERIENCE)
            database.execute(_HOME)
        except BaseException:
            database.close()
            raise
        return database

    def _close_if_open(self) -> None:
        if (database := getattr(self, "_database", None)) is not None:
            database.close()

    def _move_away(self) -> None:
        stamp = time.strftime("%Y%m%d-%H%M%S")
        self.set_aside = self._path.with_name(f"{self._path.name}.{stamp}.unreadable")
        self._path.rename(self.set_aside)
        for ending in ("-wal", "-shm"):
            beside = self._path.with_name(self._path.name + ending)
            with contextlib.suppress(FileNotFoundError):
                beside.rename(self.set_aside.with_name(self.set_aside.name + ending))

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[None]:
        try:
            self._database.execute("BEGIN IMMEDIATE")
            yield
            self._database.execute("COMMIT")
        except BaseException as error:
            with contextlib.suppress(sqlite3.Error):
                self._database.execute("ROLLBACK")
            if isinstance(error, (OSError, sqlite3.Error)):
                raise self._failed(error) from None
            raise

    def _failed(self, error: Exception) -> JournalError:
        return JournalError(
            f"the journal {self._path} cannot be used: {error}; "
            "free the disk or name another folder with the parameter journal"
        )

    def _write_self(self, before: HardState | None, hard_state: HardState) -> None:
        known = {} if before is None else _values_of(before)
        values = _values_of(hard_state).items()
        rows = [(key, json.dumps(value)) for key, value in values if known.get(key) != value]
        self._database.executemany("INSERT OR REPLACE INTO self VALUES (?, ?)", rows)

    def _write_changes(self, before: Log, log: Log) -> None:
        base, old = log.base.position.version, before.base.position.version
        if base > old:
            for entry in before.entries[: base - old]:
                forgotten = [(task_id,) for task_id in entry.forgotten]
                self._database.executemany("DELETE FROM records WHERE task = ?", forgotten)
                self._write_records(entry.records)
            self._database.execute("DELETE FROM entries WHERE version <= ?", (base,))
        known = before.entries[base - old :]
        # A log whose last known entry is still there only grew.
        grew = bool(known) and log.entries[len(known) - 1 : len(known)] == known[-1:]
        same = len(known) if grew else 0
        while same < min(len(known), len(log.entries)) and known[same] is log.entries[same]:
            same += 1
        if same < len(known):
            self._database.execute("DELETE FROM entries WHERE version > ?", (base + same,))
        self._write_entries(log.entries[same:])

    def _write_records(self, records: Iterable[TaskRecord]) -> None:
        self._database.executemany(
            "INSERT INTO records VALUES"
            " (:task, (SELECT coalesce(max(place), -1) + 1 FROM records), :record)"
            " ON CONFLICT (task) DO UPDATE SET record = :record",
            [{"task": each.task.id, "record": to_json(each)} for each in records],
        )

    def _write_entries(self, entries: Iterable[Entry]) -> None:
        rows = [(entry.version, to_json(entry)) for entry in entries]
        self._database.executemany("INSERT INTO entries VALUES (?, ?)", rows)

    def _read(self) -> HardState | None:
        rows = self._database.execute("SELECT key, value FROM self")
        values = {key: json.loads(value) for key, value in rows}
        if not values:
            return None
        rows = self._database.execute("SELECT task, record FROM records ORDER BY place")
        known = {task: self._record(json.loads(text)) for task, text in rows}
        rows = self._database.execute("SELECT entry FROM entries ORDER BY version")
        entries = tuple(_entry(json.loads(text), self._record) for (text,) in rows)
        earlier = values.get("earlier", 0)  # Journals of older versions lack it.
        given = map(_grant, values.get("grants", ()))
        grants = {each.charger: each for each in given}
        position, members = Position(*values["base"]), tuple(values["members"])
        base = Snapshot(position, known, members, earlier, grants)
        log = Log.of(base, entries, values["committed"])
        return HardState(values["member"], values["epoch"], values["vote"], log, values["hive"])

    def _record(self, values: dict[str, Any]) -> TaskRecord:
        return self._usable(_record, values["task"]["id"], values)

    def _usable(
        self, read: Callable[[dict[str, Any]], _Read], task_id: str, values: dict[str, Any]
    ) -> _Read:
        """Return what was written about a task; the text of what it raises names the task."""
        try:
            return read(values)
        except KeyError as error:
            raise unusable(self._path, task_id, f"it has no {error}") from None
        except (ValueError, TypeError) as error:
            raise unusable(self._path, task_id, str(error)) from None


def unusable(path: Path, task_id: str, reason: str) -> JournalError:
    """Return the error for a journal with a task that this version cannot use."""
    return JournalError(
        f"the journal {path} has the task {task_id}, which this version cannot use: {reason}; "
        "start the version that has written it, or end all members and remove the task on every "
        f"machine: hive recover --drop {task_id}"
    )


def drop_task(path: Path, task_id: str) -> bool:
    """Remove a task from a journal, whatever its record looks like; return whether it was there.

    Its number counts as given, so a later task of the same id gets a higher one. What may be on
    board of a robot stays noted.

    Raises:
        JournalError: A member has the journal open, or it cannot be read or written.
    """
    try:
        with closing(_open_alone(path)) as database, database:
            database.execute("BEGIN EXCLUSIVE")
            return _dropped(database, task_id)
    except (sqlite3.Error, OSError, ValueError, KeyError, TypeError) as error:
        hint = f" (a hive that runs removes a task with: hive cancel {task_id})"
        raise _not_changed(path, error, hint) from None


def owner_of(path: Path) -> tuple[str, str] | None:
    """Return the id of a journal's member and of its hive; also while a member has it open.

    None if the member belongs to no hive, or if the file is no journal that can be read.
    """
    try:
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as database:
            known = dict(database.execute("SELECT key, value FROM self").fetchall())
            member, hive = json.loads(known["member"]), json.loads(known["hive"])
    except (sqlite3.Error, OSError, ValueError, KeyError, TypeError):
        return None
    return (member, hive) if hive else None


def _open_alone(path: Path) -> sqlite3.Connection:
    """Open a journal that exists, and keep members out until it is closed.

    Raises:
        sqlite3.Error: A member has it open, or it is no whole journal.
    """
    database = sqlite3.connect(
        f"{path.resolve().as_uri()}?mode=rw", timeout=_LOCK_TIME, isolation_level=None, uri=True
    )
    try:
        _check_whole(database, is_new=False)
        database.execute("PRAGMA locking_mode = EXCLUSIVE")
        # SQLite refuses this while anybody else has the file open.
        database.execute("PRAGMA journal_mode = DELETE")
        database.executescript(f"BEGIN EXCLUSIVE; {_HOLD}; {_EXPERIENCE}; COMMIT;")
    except BaseException:
        database.close()
        raise
    return database


def _not_changed(path: Path, error: Exception, hint: str = "") -> JournalError:
    why = f"it cannot be read: {error}"
    if _is_locked(error):
        why = f"a member has it open; end all members first{hint}"
    return JournalError(f"the journal {path} was not changed: {why}")


def _in_use(path: Path) -> JournalError:
    return JournalError(
        f"the journal {path} is in use by another program, such as `hive recover`; start this "
        "member again when that has ended"
    )


def _is_locked(error: Exception) -> bool:
    """Return whether another program keeps this one out; the file may be in order."""
    return isinstance(error, sqlite3.OperationalError) and "locked" in str(error)


def _dropped(database: sqlite3.Connection, task_id: str) -> bool:
    records = database.execute("SELECT record FROM records WHERE task = ?", (task_id,)).fetchall()
    gone = [json.loads(text) for (text,) in records]
    database.execute("DELETE FROM records WHERE task = ?", (task_id,))
    for version, text in database.execute("SELECT version, entry FROM entries").fetchall():
        entry = json.loads(text)
        mine = [record for record in entry["records"] if record["task"]["id"] == task_id]
        if mine:
            gone += mine
            entry["records"] = [record for record in entry["records"] if record not in mine]
            row = json.dumps(entry), version
            database.execute("UPDATE entries SET entry = ? WHERE version = ?", row)
    reports = database.execute("DELETE FROM reports WHERE task = ?", (task_id,)).rowcount
    if gone:
        known = database.execute("SELECT value FROM self WHERE key = 'earlier'").fetchone()
        numbers = [json.loads(known[0])] if known else []
        numbers += [record.get("assignment", 0) for record in gone]
        row = "earlier", json.dumps(max(numbers))
        database.execute("INSERT OR REPLACE INTO self VALUES (?, ?)", row)
    return bool(gone or reports)


def _values_of(hard_state: HardState) -> dict[str, Any]:
    """Return what a member remembers beside the task list."""
    log = hard_state.log
    return {
        "member": hard_state.member,
        "epoch": hard_state.epoch,
        "vote": hard_state.vote,
        "hive": hard_state.hive,
        "base": list(log.base.position),
        "members": list(log.base.members),
        "earlier": log.base.earlier,
        "grants": [asdict(each) for each in log.base.grants.values()],
        "committed": log.committed,
    }


def _check_whole(database: sqlite3.Connection, *, is_new: bool) -> None:
    """Refuse a file before anything is written to it."""
    (application,) = database.execute("PRAGMA application_id").fetchone()
    (format_,) = database.execute("PRAGMA user_version").fetchone()
    (found,) = database.execute("PRAGMA quick_check(1)").fetchone()
    if not is_new and (application, format_) != (_APPLICATION, _FORMAT):
        raise sqlite3.DatabaseError("another program has written it")
    if found != "ok":
        raise sqlite3.DatabaseError(found)


def _continues(before: Log, log: Log) -> bool:
    """Return whether a log came from another by changes of its end and by folding."""
    return before.base is log.base or log.base.position == before.at(log.base.position.version)


def fields_of(value: Any) -> dict[str, Any]:  # noqa: ANN401  (any dataclass)
    """Return the fields of a value by name, for `json.dumps`.

    `asdict` would copy nested values, and `fields` takes ten times as long. A Pose among the goals
    becomes an object; `json` would make it a list.
    """
    values = {name: getattr(value, name) for name in value.__dataclass_fields__}
    if "goals" in values:
        values["goals"] = [goal._asdict() for goal in values["goals"]]
    return values


def to_json(value: TaskRecord | Entry | TaskUpdate | Hold) -> str:
    """Return a value as a journal holds it."""
    return json.dumps(value, default=fields_of)


# These raise ValueError for an unknown state, KeyError for a missing field and TypeError for an
# unknown one.


def _entry(values: dict[str, Any], read: Callable[[dict[str, Any]], TaskRecord]) -> Entry:
    records = tuple(map(read, values["records"]))
    members = None if values["members"] is None else tuple(values["members"])
    forgotten = tuple(values.get("forgotten", ()))  # Journals of older versions lack it.
    grants = tuple(map(_grant, values.get("grants", ())))
    return Entry(values["epoch"], values["version"], records, members, forgotten, grants)


def _grant(values: dict[str, Any]) -> Grant:
    """Read a grant; in journals of older versions it answers no request that a robot repeats."""
    return Grant(values["charger"], values["robot"], values.get("since", 0.0), values["there"])


def _report(values: dict[str, Any]) -> TaskUpdate:
    return TaskUpdate(state=TaskState(values.pop("state")), **values)


def _hold(values: dict[str, Any]) -> Hold:
    return Hold(tuple(Load(**load) for load in values["loads"]), values["sure"])


def _home(values: dict[str, Any]) -> Pose:
    home = Pose(**values)
    if home.flaw:
        raise ValueError(home.flaw)
    return home


def _record(values: dict[str, Any]) -> TaskRecord:
    task = values.pop("task")
    goals = tuple(Pose(**goal) for goal in task.pop("goals"))
    state = TaskState(values.pop("state"))
    others: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in values.items()
    }
    return TaskRecord(Task(goals=goals, **task), state, **others)
