# SPDX-License-Identifier: BSD-3-Clause
"""A member goes on as the only one of a hive whose majority is gone."""

from dataclasses import replace
from random import Random

import pytest

from blackboard.consensus.bootstrap import restore
from blackboard.consensus.election import campaign_if_due
from blackboard.consensus.journal import HardState, SqliteJournal
from blackboard.consensus.log import Entry, Log, Position, Snapshot
from blackboard.consensus.member import Role
from blackboard.consensus.recovery import newest, recover_journal, recovered, succeeds
from blackboard.domain.record import Hold, Load, TaskRecord, TaskUpdate
from blackboard.domain.settings import RaftSettings
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.errors import JournalError
from hive_common.pose import Pose

MEMBERS = ("blackboard#1", "robot1#1", "robot2#1")
ONE, TWO, THREE = (TaskRecord(Task(f"T{n}", TaskType.GA, (Pose(1.0, 2.0),))) for n in range(1, 4))
LOG = (
    Log.of(Snapshot(Position(3, 5), {"T1": ONE}, MEMBERS, earlier=7))
    .append(Entry(3, 6, (TWO,)))
    .append(Entry(3, 7, members=MEMBERS[:2]))
    .append(Entry(3, 8, (THREE,)))
    .commit(6, kept=100)
)
HOLD = Hold((Load("T2", 1.0, "hive1", 4),))
REPORT = TaskUpdate("T1", TaskState.WAITING, "robot1", assignment=3)
DISK = HardState("robot1#1", 3, "robot2#1", LOG, "hive1")


def test_the_member_that_goes_on_is_the_only_one_and_keeps_all_its_tasks():
    after = recovered(DISK, Random(1))

    assert after.log.latest.members == after.log.stable.members == ("robot1#1",)
    assert list(after.log.latest.records) == ["T1", "T2", "T3"]
    assert list(after.log.stable.records) == ["T1", "T2"]
    assert (after.log.position, after.log.latest.earlier) == (Position(3, 8), 7)
    assert (after.member, after.epoch, after.vote) == ("robot1#1", 3, "")


def test_it_leads_at_once_in_a_higher_epoch_and_commits_what_it_has():
    member = restore(recovered(DISK, Random(1)), RaftSettings(), now=0.0)

    member, _ = campaign_if_due(member, 0.0, 0.5)

    assert (member.role, member.epoch) == (Role.LEADER, 4)
    assert list(member.log.stable.records) == ["T1", "T2", "T3"]


def test_its_hive_succeeds_the_one_before_and_no_other():
    first = recovered(DISK, Random(1)).hive
    second = recovered(replace(DISK, hive=first), Random(2)).hive

    assert succeeds(first, "hive1")
    assert succeeds(second, first)
    assert succeeds(second, "hive1")
    assert not succeeds("hive1", first)
    assert not succeeds(first, first)
    assert not succeeds("hive10", "hive1")
    assert not succeeds("hive1", "")


def test_two_recoveries_of_one_hive_are_two_hives():
    assert recovered(DISK, Random(1)).hive != recovered(DISK, Random(2)).hive


def test_the_newest_disk_is_the_one_that_would_be_elected():
    behind = replace(DISK, log=Log.of(LOG.base, LOG.entries[:2]), epoch=9)
    longer_but_older = replace(
        DISK, log=Log.of(LOG.base, tuple(Entry(2, version) for version in range(6, 20)))
    )
    recovered_before = recovered(behind, Random(1))

    assert newest([behind, DISK, longer_but_older]) is DISK
    assert newest([behind, recovered_before, DISK]) is recovered_before


def test_a_recovered_file_holds_it_after_it_was_closed(tmp_path):
    path = tmp_path / "robot1.sqlite3"
    before = SqliteJournal(path)
    before.save(DISK)
    before.save_hold(HOLD)
    before.save_reports([REPORT])
    before.close()

    after = recover_journal(path, Random(1))

    again = SqliteJournal(path)
    assert again.load() == after == recovered(DISK, Random(1))
    assert again.load_hold() == HOLD
    assert again.load_reports() == (REPORT,)
    again.close()


def test_a_journal_of_no_hive_stays_as_it_is(tmp_path):
    path = tmp_path / "robot1.sqlite3"
    SqliteJournal(path).close()

    with pytest.raises(JournalError, match="was not changed: its member has no hive"):
        recover_journal(path, Random(1))
