# SPDX-License-Identifier: BSD-3-Clause
"""A member opens its journal, and does not begin with a task that it could not work on."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from blackboard.consensus.journal import HardState, SqliteJournal
from blackboard.consensus.log import Entry, Log, Position, Snapshot
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskType
from blackboard.errors import JournalError
from blackboard.ros import membership
from hive_common.pose import Pose

FAR = TaskRecord(Task("T7", TaskType.GA, (Pose(1e308, 2.0),)))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The folder of journals, as the parameter `journal` names it."""
    monkeypatch.setattr(membership, "named_folder", lambda _caller: str(tmp_path))
    return tmp_path


@pytest.mark.parametrize("folded", [True, False])
def test_a_task_that_an_older_version_has_accepted_stops_its_member_and_is_named(folder, folded):
    journal = SqliteJournal(folder / "robot1.sqlite3")
    log = Log.of(Snapshot(Position(1, 1), {}, ("robot1#1",))).append(Entry(1, 2, (FAR,)))
    log = log.append(Entry(1, 3))
    journal.save(HardState("robot1#1", 1, "", log.commit(3, kept=0) if folded else log))
    journal.close()

    with pytest.raises(JournalError, match=r"the task T7, which .* cannot use: goal.*1e\+308"):
        membership.open_journal("/robot1")


def test_a_member_opens_its_journal_in_the_folder_that_is_named(folder):
    journal = membership.open_journal("/robot1")

    assert journal.load() is None
    assert [path.name for path in folder.glob("*.sqlite3")] == ["robot1.sqlite3"]


def belongs_to(folder, member, hive):
    """Write the journal of a member of a hive, and leave it open as a node does."""
    journal = SqliteJournal(folder / f"{member.strip('/').replace('/', '-')}.sqlite3")
    log = Log.of(Snapshot(Position(1, 1), {}, (f"{member}#1",)))
    journal.save(HardState(f"{member}#1", 1, "", log, hive))
    return journal


def test_where_journals_of_robots_name_a_hive_no_other_is_bootstrapped(folder):
    belongs_to(folder, "/robot1/robot", "7f3a")
    belongs_to(folder, "/robot2/robot", "7f3a").close()

    said = membership.hive_beside("/blackboard", "/")

    assert f"journals of robots in {folder} name a hive: 7f3a (robot1, robot2). It waits" in said
    assert "hive recover --force-members" in said


def test_journals_of_no_hive_and_of_other_namespaces_do_not_count(folder):
    belongs_to(folder, "/robot1/robot", "").close()
    belongs_to(folder, "/hall/robot1/robot", "7f3a").close()
    belongs_to(folder, "/hall/blackboard", "7f3a").close()
    (folder / "notes.sqlite3").write_text("no journal")

    assert membership.hive_beside("/blackboard", "/") == ""
    assert membership.hive_beside("/lab/blackboard", "/lab/") == ""
    assert "name a hive: 7f3a (robot1)." in membership.hive_beside("/hall/blackboard", "/hall/")
