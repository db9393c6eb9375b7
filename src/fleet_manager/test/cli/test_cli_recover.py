# SPDX-License-Identifier: BSD-3-Clause
"""`hive recover`, on the journals of a folder."""

import contextlib
from dataclasses import replace

import pytest

from blackboard.auction.decision_log import ENDING, SqliteBook
from blackboard.consensus.journal import HardState, SqliteJournal
from blackboard.consensus.log import Entry, Log, Position, Snapshot
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
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
    assert "robot1.sqlite3 was not changed: a member has it open; end all members first" in err
    journal.close()


MEMBERS = ("/blackboard#1", *(f"/robot{number}/robot#1" for number in range(1, 5)))
DONE = replace(TASK, task=replace(TASK.task, id="T8"), state=TaskState.DONE)


def write(folder, member, changes, hive="3fa9"):
    """Write the journal of one of the members, with some changes after its snapshot."""
    log = Log.of(Snapshot(Position(4, 20), {"T8": DONE}, MEMBERS))
    for number in range(changes):
        log = log.append(Entry(4, 21 + number, (TASK,)))
    path = folder / f"{member.partition('#')[0].strip('/').replace('/', '-')}.sqlite3"
    with contextlib.closing(SqliteJournal(path)) as journal:
        journal.save(HardState(member, 4, "", log, hive))
    return path


def read(path):
    """Return what a journal holds."""
    with contextlib.closing(SqliteJournal(path)) as journal:
        return journal.load()


@pytest.fixture
def left(folder):
    """The journals of two of five members; robot2 has the newer one."""
    for path in folder.glob("*.sqlite3"):
        path.unlink()
    return write(folder, MEMBERS[1], 1), write(folder, MEMBERS[2], 2)


@pytest.mark.usefixtures("left")
def test_without_an_option_it_lists_the_disks_and_how_many_are_missing(hive):
    code, out, err = hive("recover")

    assert (code, err) == (0, "")
    listed = "blackboard, robot1, robot2, robot3, robot4"
    begin = "Journals here: 2 of the 5 on robot2's list of hive 3fa9."
    remedy = "hive recover --force-members MEMBER,..."
    assert out.splitlines() == [
        "MEMBER  HIVE  EPOCH  CHANGE  TASKS  OPEN  MEMBERS ON ITS LIST",
        f"robot1  3fa9  4      21      2      1     {listed}",
        f"robot2  3fa9  4      22      2      1     {listed}",
        "",
        f"{begin} The hive decides nothing before 3 of them run; if so many never will: {remedy}",
    ]


@pytest.mark.usefixtures("left")
def test_where_a_majority_is_left_it_says_so(hive, folder):
    write(folder, MEMBERS[0], 0)

    _, out, _ = hive("recover")

    assert "Journals here: 3 of the 5 on robot2's list of hive 3fa9. That is a majority:" in out


def test_a_hive_of_which_a_majority_is_here_is_recovered_only_by_a_person_who_insists(
    hive, folder, left
):
    write(folder, MEMBERS[0], 0)

    code, _, err = hive("recover", "--force-members", "robot2")
    kept = read(left[1]).hive
    insisted, _, _ = hive("recover", "--force-members", "robot2", "--yes")

    assert (code, kept) == (2, "3fa9")
    assert "3 of the 5 on robot2's list of hive 3fa9. That is a majority: start them" in err
    assert insisted == 0
    assert read(left[1]).hive.startswith("3fa9.")


def test_what_was_recovered_is_described_and_no_more_what_it_was_before(hive, left):
    hive("recover", "--force-members", "robot2")

    _, out, _ = hive("recover")

    told = [line for line in out.splitlines() if line.startswith("Journals here")]
    assert len(told) == 1
    assert f"1 of the 1 on robot2's list of hive {read(left[1]).hive}. That is a maj" in told[0]


@pytest.mark.parametrize("names", ["robot1,robot2", " /robot2/robot , robot1", "robot2/robot"])
def test_the_newest_of_the_members_that_are_left_goes_on_alone(hive, left, names):
    code, out, err = hive("recover", "--force-members", names)

    assert code == 0
    after = read(left[1])
    assert after.log.latest.members == (MEMBERS[2],)
    assert after.hive.startswith("3fa9.")
    assert f"robot2 is the only member of hive {after.hive} now (before: 3fa9)" in out
    assert "with 2 tasks, 1 of them open" in out
    assert "the other members (blackboard, robot1, robot3, robot4) cannot be a majority" in err
    assert read(left[0]).log.latest.members == MEMBERS


def test_what_is_recovered_is_not_recovered_once_more_by_accident(hive, left):
    hive("recover", "--force-members", "robot1,robot2")
    first = read(left[1]).hive

    code, _, _ = hive("recover", "--force-members", "robot1,robot2")
    kept = read(left[1]).hive
    hive("recover", "--force-members", "robot1,robot2", "--yes")

    assert (code, kept) == (2, first)
    assert read(left[1]).hive.startswith(f"{first}.")
    assert read(left[0]).hive == "3fa9"


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (
            "robot3",
            "no journal in {} belongs to 'robot3'; allowed: robot1, robot2. Members on oth",
        ),
        ("robot1,", "no journal in {} belongs to ''"),
        ("robot1,robot5", "robot5 belongs to no hive, so there is nothing to recover; leave it"),
        ("robot1,robot6", "hive 3fa9, and robot6 to hive 77; name members of one hive"),
    ],
)
def test_what_cannot_go_on_is_named_and_nothing_changes(hive, folder, left, names, said):
    write(folder, "/robot5/robot#1", 0, hive="")
    write(folder, "/robot6/robot#1", 9, hive="77")
    if "robot3" in names:
        (folder / "robot5-robot.sqlite3").unlink()
        (folder / "robot6-robot.sqlite3").unlink()
    before = [read(path) for path in left]

    code, _, err = hive("recover", "--force-members", names)

    assert code == 2
    assert said.format(folder) in err
    assert [read(path) for path in left] == before


def test_members_that_run_are_not_recovered(hive, left):
    journal = SqliteJournal(left[0])

    code, _, err = hive("recover", "--force-members", "robot2")

    assert code == 2
    assert "robot1-robot.sqlite3 was not changed: a member has it open; end all" in err
    assert read(left[1]).hive == "3fa9"
    journal.close()


def test_a_folder_without_journals_is_named(hive, tmp_path):
    empty = tmp_path / "empty"
    empty.mkdir()

    code, _, err = hive("recover", "--journal", str(empty))

    assert code == 2
    assert f"no member has a journal in {empty}; name another folder with --journal" in err


def test_two_remedies_at_once_are_refused(hive):
    code, _, err = hive("recover", "--drop", "T7", "--force-members", "robot1")

    assert code == 2
    assert "do one after the other" in err
