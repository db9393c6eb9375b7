# SPDX-License-Identifier: BSD-3-Clause
"""`hive recover`, on the journals of a folder."""

import contextlib

import pytest

from blackboard.auction.decision_log import ENDING, SqliteBook
from blackboard.consensus.journal import HardState, SqliteJournal
from blackboard.consensus.log import Entry, Log, Position, Snapshot
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskType
from fleet_manager.cli.context import CliContext
from fleet_manager.cli.main import run
from hive_common.pose import Pose

TASK = TaskRecord(Task("T7", TaskType.GA, (Pose(1.0, 2.0),)))


@pytest.fixture
def folder(tmp_path):
    """A folder with the disks of three members, of which two have T7 on their list."""
    for member, records in (("blackboard", (TASK,)), ("robot1", (TASK,)), ("robot2", ())):
        journal = SqliteJournal(tmp_path / f"{member}.sqlite3")
        base = Snapshot(Position(1, 1), {}, (member,))
        log = Log.of(base).append(Entry(1, 2, records))
        journal.save(HardState(member, 1, "", log))
        journal.close()
    SqliteBook(tmp_path / f"blackboard{ENDING}").close()
    return tmp_path


@pytest.fixture
def hive(folder, capsys):
    """Run the command line on that folder."""

    def call(*words):
        code = run(CliContext(lambda _: contextlib.nullcontext(), lambda: folder), list(words))
        out, err = capsys.readouterr()
        return code, out, err

    return call


def test_a_task_is_removed_from_every_journal_that_has_it(hive, folder):
    code, out, err = hive("recover", "--drop", "T7")

    assert (code, err) == (0, "")
    assert out == f"T7 is removed from the journals of blackboard, robot1 in {folder}\n"
    for member in ("blackboard", "robot1", "robot2"):
        journal = SqliteJournal(folder / f"{member}.sqlite3")
        assert dict(journal.load().log.latest.records) == {}
        journal.close()


def test_a_task_that_no_journal_has_is_named_with_the_folder(hive, folder):
    code, _, err = hive("recover", "--drop", "T8", "--journal", str(folder))

    assert code == 1
    assert err.startswith(f"hive: no journal in {folder} has T8; name another folder")


def test_a_hive_that_runs_is_left_alone(hive, folder):
    journal = SqliteJournal(folder / "robot1.sqlite3")

    code, _, err = hive("recover", "--drop", "T7")

    assert code == 2
    assert "robot1.sqlite3: a member has it open; end all members first" in err
    journal.close()


def test_without_a_task_the_command_says_what_is_missing(hive):
    code, _, err = hive("recover")

    assert code == 2
    assert "'--drop'" in err
