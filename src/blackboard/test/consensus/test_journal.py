# SPDX-License-Identifier: BSD-3-Clause
"""A journal returns what was written, and destroys nothing that it cannot read."""

import json
import math
import sqlite3
from contextlib import closing
from dataclasses import replace

import pytest

from blackboard.consensus.journal import HardState, SqliteJournal, drop_task, owner_of
from blackboard.consensus.log import Entry, Log, Position, Snapshot
from blackboard.domain.charger import Grant
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


@pytest.mark.parametrize("kept", [1, 100])
def test_the_next_process_reads_who_has_a_charger_folded_or_not(path, kept):
    journal = SqliteJournal(path)
    log = EMPTY.log
    given = (Grant("east", "robot1", 2.5), Grant("west", "robot2", 3.5, there=True))
    for grant in (*given, Grant("east"), Grant("east", "robot3", 1.5)):
        log = log.append(Entry(3, log.position.version + 1, grants=(grant,)))
        log = log.commit(log.position.version, kept)
        journal.save(replace(EMPTY, log=log))

    known = again(journal, path).load()

    assert known == replace(EMPTY, log=log)
    assert dict(known.log.latest.grants) == {
        "east": Grant("east", "robot3", 1.5),
        "west": Grant("west", "robot2", 3.5, there=True),
    }


def test_a_journal_of_a_version_that_numbered_grants_is_read(path):
    journal = SqliteJournal(path)
    journal.save(replace(EMPTY, log=EMPTY.log.append(Entry(3, 2, grants=(Grant("east", "a"),)))))
    journal.close()
    with closing(sqlite3.connect(path)) as database, database:
        ((text,),) = database.execute("SELECT entry FROM entries").fetchall()
        entry = json.loads(text)
        del entry["grants"][0]["since"]
        entry["grants"][0]["number"] = 2
        database.execute("UPDATE entries SET entry = ?", (json.dumps(entry),))

    assert SqliteJournal(path).load().log.latest.grants == {"east": Grant("east", "a")}


def test_a_journal_of_a_version_without_forgetting_and_grants_is_read(path):
    journal = SqliteJournal(path)
    journal.save(replace(EMPTY, log=EMPTY.log.append(Entry(3, 2, (replace(TWO, assignment=1),)))))
    journal.close()
    with closing(sqlite3.connect(path)) as database, database:
        ((text,),) = database.execute("SELECT entry FROM entries").fetchall()
        entry = json.loads(text)
        del entry["forgotten"], entry["records"][0]["earlier"], entry["grants"]
        database.execute("UPDATE entries SET entry = ?", (json.dumps(entry),))
        database.execute("DELETE FROM self WHERE key IN ('earlier', 'grants')")

    latest = SqliteJournal(path).load().log.latest

    assert latest.records["T2"] == replace(TWO, assignment=1)
    assert latest.earlier == 0
    assert dict(latest.grants) == {}


@pytest.mark.parametrize("no_split", [True, False])
def test_whether_a_task_may_be_split_is_read_again(path, no_split):
    record = replace(ONE, task=replace(ONE.task, no_split=no_split), division="split into ...")
    journal = SqliteJournal(path)
    journal.save(replace(EMPTY, log=EMPTY.log.append(Entry(3, 2, (record,)))))

    assert again(journal, path).load().log.latest.records["T1"] == record


def test_a_journal_of_a_version_that_always_split_is_read(path):
    journal = SqliteJournal(path)
    journal.save(replace(EMPTY, log=EMPTY.log.append(Entry(3, 2, (ONE,)))))
    journal.close()
    with closing(sqlite3.connect(path)) as database, database:
        ((text,),) = database.execute("SELECT entry FROM entries").fetchall()
        entry = json.loads(text)
        del entry["records"][0]["division"], entry["records"][0]["task"]["no_split"]
        database.execute("UPDATE entries SET entry = ?", (json.dumps(entry),))

    assert dict(SqliteJournal(path).load().log.latest.records) == {"T1": ONE}


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


def test_the_next_process_knows_where_the_robot_goes_from_a_charger(path):
    journal = SqliteJournal(path)
    assert journal.load_home() is None
    journal.save_home(Pose(1.0, 2.0))
    journal.save_home(Pose(3.0, 4.0, 0.5))

    assert again(journal, path).load_home() == Pose(3.0, 4.0, 0.5)


def test_a_file_with_a_home_that_is_no_place_is_set_aside(path):
    journal = SqliteJournal(path)
    journal.save_home(Pose(1.0, math.nan))
    journal.close()

    again = SqliteJournal(path)

    assert again.set_aside
    assert again.load_home() is None


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


def with_a_record_of_another_version(path, *, folded):
    """Write a journal with T1 and T2, of which T2 has a state that this version does not know."""
    journal = SqliteJournal(path)
    log = EMPTY.log.append(Entry(3, 2, (ONE, replace(TWO, assignment=7))))
    log = log.append(Entry(3, 3, (replace(ONE, step=1),)))
    journal.save(replace(EMPTY, log=log.commit(3, kept=0) if folded else log))
    journal.save_reports([replace(DONE, task_id="T2")])
    journal.close()
    with closing(sqlite3.connect(path)) as database, database:
        database.create_function("paused", 1, paused)
        database.execute("UPDATE records SET record = paused(record)")
        database.execute("UPDATE entries SET entry = paused(entry)")


def paused(text):
    """Return a record or an entry, as JSON, with the state PAUSED for T2."""
    value = json.loads(text)
    for record in value.get("records", [value]):
        if record["task"]["id"] == "T2":
            record["state"] = "PAUSED"
    return json.dumps(value)


@pytest.mark.parametrize("folded", [True, False])
def test_a_task_that_this_version_cannot_use_stops_its_member_and_is_named(path, folded):
    with_a_record_of_another_version(path, folded=folded)
    before = path.read_bytes()

    with pytest.raises(JournalError) as error:
        SqliteJournal(path)

    assert str(error.value) == (
        f"the journal {path} has the task T2, which this version cannot use: 'PAUSED' is not a "
        "valid TaskState; start the version that has written it, or end all members and remove "
        "the task on every machine: hive recover --drop T2"
    )
    assert path.read_bytes() == before
    assert [each.name for each in path.parent.glob("*unreadable*")] == []


def test_a_report_that_this_version_cannot_use_is_named_too(path):
    journal = SqliteJournal(path)
    journal.save_reports([DONE])
    journal.close()
    with closing(sqlite3.connect(path)) as database, database:
        ((text,),) = database.execute("SELECT report FROM reports").fetchall()
        report = {**json.loads(text), "state": 77}
        database.execute("UPDATE reports SET report = ?", (json.dumps(report),))

    with pytest.raises(JournalError, match="has the task T1, which this version cannot use"):
        SqliteJournal(path)

    assert drop_task(path, "T1")
    assert SqliteJournal(path).load_reports() == ()


def test_a_file_with_a_hold_that_is_no_json_is_set_aside(path):
    journal = SqliteJournal(path)
    journal.save_hold(Hold(sure=True))
    journal.close()
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("UPDATE hold SET hold = '{'")

    again = SqliteJournal(path)

    assert again.set_aside
    assert again.load_hold() == Hold()


@pytest.mark.parametrize("folded", [True, False])
def test_a_task_that_is_dropped_is_gone_and_its_number_stays_given(path, folded):
    with_a_record_of_another_version(path, folded=folded)

    assert drop_task(path, "T2")
    assert not drop_task(path, "T2")
    journal = SqliteJournal(path)
    latest = journal.load().log.latest
    assert dict(latest.records) == {"T1": replace(ONE, step=1)}
    assert latest.position == Position(3, 3)
    assert latest.earlier == 7
    assert journal.load_reports() == ()


def test_nothing_is_dropped_from_a_journal_that_a_member_has_open(path):
    journal = SqliteJournal(path)
    journal.save(replace(EMPTY, log=EMPTY.log.append(Entry(3, 2, (ONE,)))))

    with pytest.raises(
        JournalError, match=r"was not changed: a member has it open; end .*hive cancel T1"
    ):
        drop_task(path, "T1")

    assert "T1" in again(journal, path).load().log.latest.records


def test_nothing_is_dropped_from_a_file_that_is_no_journal(path):
    path.parent.mkdir()
    path.write_bytes(b"somebody's work" * 100)

    with pytest.raises(JournalError, match="was not changed: it cannot be read"):
        drop_task(path, "T1")

    assert path.read_bytes() == b"somebody's work" * 100


def test_a_journal_that_a_member_has_open_is_not_opened_alone(path):
    journal = SqliteJournal(path)
    journal.save(EMPTY)

    with pytest.raises(JournalError, match="was not changed: a member has it open; end all"):
        SqliteJournal(path, alone=True)

    assert again(journal, path).load() == EMPTY


def test_no_member_opens_a_journal_that_is_open_alone(path):
    SqliteJournal(path).close()
    alone = SqliteJournal(path, alone=True)

    with pytest.raises(JournalError, match="is in use by another program, such as `hive recover`"):
        SqliteJournal(path)

    alone.close()
    journal = SqliteJournal(path)
    assert journal.set_aside is None
    journal.close()


@pytest.mark.parametrize("content", [b"somebody's work" * 100, b"", None])
def test_what_is_no_journal_is_neither_opened_alone_nor_set_aside(path, content):
    path.parent.mkdir()
    if content is not None:
        path.write_bytes(content)

    with pytest.raises(JournalError, match=r"was not changed|cannot be used"):
        SqliteJournal(path, alone=True)

    assert list(path.parent.iterdir()) == ([] if content is None else [path])


def test_the_owner_of_a_journal_is_known_also_while_it_is_open(path):
    journal = SqliteJournal(path)
    before = owner_of(path)
    journal.save(replace(EMPTY, hive="hive1"))

    assert before is None
    assert owner_of(path) == (EMPTY.member, "hive1")
    journal.close()


def test_a_file_that_is_no_journal_has_no_owner(path):
    path.parent.mkdir()
    path.write_bytes(b"somebody's work" * 100)

    assert owner_of(path) is None
    assert owner_of(path.with_name("none.sqlite3")) is None
