# SPDX-License-Identifier: BSD-3-Clause
"""A journal returns what was written, and destroys nothing that it cannot read."""

import json
import sqlite3
from contextlib import closing
from dataclasses import replace

import pytest

from blackboard.consensus.journal import HardState, SqliteJournal
from blackboard.consensus.log import Entry, Log, Position, Snapshot
from blackboard.domain.record import Hold, Load, TaskRecord, TaskUpdate
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.errors import JournalError
from hive_common.pose import Pose

GOALS = (Pose(1.0, 2.0), Pose(3.0, 4.0, 0.5))
ONE = TaskRecord(Task("T1", TaskType.GAB, GOALS, payload=1.5), assignment=2)
TWO = TaskRecord(Task("T2", TaskType.GA, (Pose(5.0, 6.0),)), tried=("robot1", "robot2"))
EMPTY = HardState("robot1#1", 3, "robot2#5", Log.of(Snapshot(Position(1, 1), {}, ("robot1#1",))))
DONE = TaskUpdate("T1", TaskState.DONE, "robot1", 2, 2, assignment=4)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "deep" / "robot1.sqlite3"


def again(journal, path):
    """Return the journal as the next process finds it."""
    journal.close()
    return SqliteJournal(path)


def test_a_new_journal_is_empty(path):
    assert SqliteJournal(path).load() is None


def test_the_next_process_reads_what_was_written(path):
    journal = SqliteJournal(path)
    journal.save(EMPTY)

    assert again(journal, path).load() == EMPTY


def test_the_next_process_reads_entries_folded_or_not(path):
    journal = SqliteJournal(path)
    log = EMPTY.log
    for version in range(2, 40):
        entry = Entry(3, version, (replace(ONE, step=version), TWO))
        log = log.append(entry).commit(version - 1, kept=5)
        journal.save(replace(EMPTY, log=log))

    known = again(journal, path).load()
    assert known == replace(EMPTY, log=log)
    assert list(known.log.latest.records) == ["T1", "T2"]


def test_replaced_entries_are_gone(path):
    journal = SqliteJournal(path)
    first = EMPTY.log.append(Entry(3, 2, (ONE,))).append(Entry(3, 3, (TWO,)))
    journal.save(replace(EMPTY, log=first))
    second = EMPTY.log.append(Entry(4, 2, (TWO,), ("robot1#1", "robot2#5")))
    journal.save(replace(EMPTY, log=second))

    assert again(journal, path).load() == replace(EMPTY, log=second)


@pytest.mark.parametrize("kept", [1, 100])
def test_forgotten_tasks_stay_forgotten_folded_or_not(path, kept):
    journal = SqliteJournal(path)
    log = EMPTY.log
    for changed, forgotten in (((ONE, TWO), ()), ((), ("T1",)), ((ONE,), ()), ((TWO,), ())):
        log = log.append(Entry(3, log.position.version + 1, changed, forgotten=forgotten))
        log = log.commit(log.position.version, kept)
        journal.save(replace(EMPTY, log=log))

    known = again(journal, path).load()

    assert known == replace(EMPTY, log=log)
    assert list(known.log.latest.records) == ["T2", "T1"]
    assert known.log.latest.earlier == ONE.assignment == 2


def test_a_journal_of_a_version_without_forgetting_is_read(path):
    journal = SqliteJournal(path)
    journal.save(replace(EMPTY, log=EMPTY.log.append(Entry(3, 2, (replace(TWO, assignment=1),)))))
    journal.close()
    with closing(sqlite3.connect(path)) as database, database:
        ((text,),) = database.execute("SELECT entry FROM entries").fetchall()
        entry = json.loads(text)
        del entry["forgotten"], entry["records"][0]["earlier"]
        database.execute("UPDATE entries SET entry = ?", (json.dumps(entry),))
        database.execute("DELETE FROM self WHERE key = 'earlier'")

    latest = SqliteJournal(path).load().log.latest

    assert latest.records["T2"] == replace(TWO, assignment=1)
    assert latest.earlier == 0


def test_the_next_process_reads_unacknowledged_reports(path):
    journal = SqliteJournal(path)
    journal.save_reports([DONE])

    assert again(journal, path).load_reports() == (DONE,)


def test_acknowledged_reports_are_gone(path):
    journal = SqliteJournal(path)
    journal.save_reports([DONE])
    journal.save_reports([])

    assert again(journal, path).load_reports() == ()


def test_the_next_process_reads_what_may_be_on_board(path):
    hold = Hold((Load("T1", 2.5, "hive1", 3),), sure=True)
    journal = SqliteJournal(path)
    assert journal.load_hold() == Hold()
    journal.save_hold(Hold(sure=True))
    journal.save_hold(hold)

    assert again(journal, path).load_hold() == hold


def test_a_damaged_file_is_renamed_unchanged(path):
    path.parent.mkdir()
    path.write_bytes(b"no database at all, but somebody's work" * 100)

    journal = SqliteJournal(path)

    assert journal.load() is None
    assert journal.set_aside.read_bytes().startswith(b"no database at all")


@pytest.mark.parametrize("length", [1000, 4000, 8000])
def test_a_file_that_is_torn_is_set_aside_byte_for_byte(path, length):
    journal = SqliteJournal(path)
    journal.save_reports([DONE])
    journal.close()
    torn = (path.read_bytes()[:900] + b"\xff" * 8000)[:length]
    path.write_bytes(torn)

    again = SqliteJournal(path)

    assert again.load() is None
    assert again.set_aside.read_bytes() == torn


def test_a_folder_that_cannot_be_created_is_named(tmp_path):
    (tmp_path / "file").write_text("")

    with pytest.raises(JournalError, match=r"file/robot1\.sqlite3 cannot be used"):
        SqliteJournal(tmp_path / "file" / "robot1.sqlite3")
