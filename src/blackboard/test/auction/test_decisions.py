# SPDX-License-Identifier: BSD-3-Clause
"""Decisions: noted, kept, read again and worked out by another cost model."""

import json
from dataclasses import asdict

import pytest

from blackboard.auction.decision import (
    Decision,
    from_plain,
    replayed,
    what_would_help,
)
from blackboard.auction.decision_log import ENDING, SqliteBook, read_decisions
from blackboard.domain.bid import MAX_COST, Bid, CostTerms, Exclusion
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.task import Task, TaskType
from blackboard.errors import JournalError
from hive_common.pose import Pose

CARRY = Task("T1", TaskType.GPAB, (Pose(1.0, 1.0), Pose(2.0, 1.0)), payload=40.0)


def bid(robot, cost=1.0, exclusion="", **terms):
    """Return a bid; terms by name."""
    known = {"energy_charge": 0.1, "charge_left": 10.0, "place": 1, "way": 5.0, "eta": 9.0}
    basis = CostTerms(**{**known, **terms}) if cost < MAX_COST else None
    return Bid(robot, "T1", cost, eta=9.0, terms=basis, exclusion=exclusion)


def decision(task="T1", auction=1, **fields):
    """Return what was decided about a task."""
    bids = (bid("robot1", 2.0), bid("robot2", MAX_COST, "charge"))
    return Decision(task, 1, auction, 1, 12.5, "robot1", bids=bids, silent=("robot3",), **fields)


def test_a_decision_survives_being_written_as_json():
    made = decision()

    assert from_plain(json.loads(json.dumps(asdict(made)))) == made


def test_the_decisions_on_a_task_are_read_from_all_files_of_a_folder_oldest_first(tmp_path):
    first, second = (SqliteBook(tmp_path / f"{name}{ENDING}") for name in ("a", "b"))
    first.note([decision(auction=2), decision("T2")])
    second.note([decision(auction=1)])

    found = read_decisions(tmp_path, "T1")

    assert [each.auction for each in found] == [1, 2]
    assert found[1] == decision(auction=2)


def test_a_log_continues_where_it_was_left(tmp_path):
    for number in (1, 2):
        book = SqliteBook(tmp_path / f"a{ENDING}")
        book.note([decision(auction=number)])
        book.close()

    assert len(read_decisions(tmp_path, "T1")) == 2


def test_the_oldest_decisions_are_deleted_when_the_file_is_full(tmp_path, monkeypatch):
    monkeypatch.setattr("blackboard.auction.decision_log.MAX_SIZE", 100_000)
    path = tmp_path / f"a{ENDING}"
    book = SqliteBook(path)
    for number in range(1, 301):
        book.note([decision(auction=number)])
    book.close()

    kept = [each.auction for each in read_decisions(tmp_path, "T1")]
    assert 80_000 < path.stat().st_size <= 110_000
    assert kept == list(range(kept[0], 301))
    assert kept[0] > 1


def test_a_decision_that_is_larger_than_the_file_may_be_stays_until_the_next(
    tmp_path, monkeypatch
):
    monkeypatch.setattr("blackboard.auction.decision_log.MAX_SIZE", 1)
    book = SqliteBook(tmp_path / f"a{ENDING}")
    for number in (1, 2, 3):
        book.note([decision(auction=number)])

    assert [each.auction for each in read_decisions(tmp_path, "T1")] == [3]


def test_a_file_that_is_no_decision_log_is_named(tmp_path):
    path = tmp_path / f"a{ENDING}"
    path.write_text("no database, but long enough to be looked at " * 10)

    with pytest.raises(JournalError, match=r"a\.auctions\.sqlite3 cannot be read"):
        read_decisions(tmp_path, "T1")
    with pytest.raises(JournalError, match="cannot be used"):
        SqliteBook(path)


def test_a_log_that_cannot_be_written_says_so(tmp_path):
    book = SqliteBook(tmp_path / f"a{ENDING}")
    book.close()

    with pytest.raises(JournalError, match="cannot be used"):
        book.note([decision()])


def test_another_cost_model_may_choose_another_robot():
    near_but_late = bid("robot1", 1.0, eta=100.0, energy_charge=0.1)
    far_but_soon = bid("robot2", 2.0, eta=10.0, energy_charge=0.5)
    made = Decision("T1", 1, 1, 1, 0.0, "robot1", bids=(near_but_late, far_but_soon))

    by_energy, by_time = replayed(made, "energy"), replayed(made, "time")

    assert [each.robot_id for each in by_energy] == ["robot1", "robot2"]
    assert [each.robot_id for each in by_time] == ["robot2", "robot1"]
    assert by_time[0].cost == pytest.approx(1000 * 10 / 610)


def test_a_robot_that_cannot_take_a_task_cannot_by_any_cost_model():
    made = decision()

    assert replayed(made, "time")[-1] == made.bids[1]


def status(robot, state=RobotState.DEFECT, carries=(100.0, 100.0, 50.0, 50.0)):
    """Return what a robot said last."""
    return RobotStatus(robot, state, Pose(0.0, 0.0), charge=1.0, carries=carries)


@pytest.mark.parametrize(
    ("exclusions", "words"),
    [
        (["payload", "payload"], "a robot that carries 40 kg with its arm"),
        (["payload", "type"], "a robot that carries 40 kg with its arm"),
        (["type"], "a robot that does GPAB"),
        (["charge", "payload"], "more charge for robot0"),
        (["charge", "service"], "more charge for robot0, or robot1 back in service"),
        (["service", "service", "service"], "robot0, robot1 or robot2 back in service"),
        (["service", "type"], "robot0 back in service"),
        (["way", "type"], "a clear way for robot0, or another goal"),
        (["cost"], ""),
        (["cost", "payload"], ""),
        (["cost", "charge"], "more charge for robot1"),
        ([], ""),
    ],
)
def test_what_would_help_follows_from_why_each_robot_is_excluded(exclusions, words):
    bids = [bid(f"robot{i}", MAX_COST, exclusion) for i, exclusion in enumerate(exclusions)]

    assert what_would_help(CARRY, bids) == words


def test_an_unknown_exclusion_gives_no_advice():
    assert what_would_help(CARRY, [bid("robot1", MAX_COST, "whim")]) == ""
    assert Exclusion("") is Exclusion.NONE


@pytest.mark.parametrize("exclusion", ["payload", "type", "whim", ""])
def test_robots_out_of_service_that_could_do_it_are_named_and_no_ability_is(exclusion):
    bids = [bid("robot1", MAX_COST, exclusion)]
    away = [status("robot4", RobotState.CHARGING), status("robot3", RobotState.OFFLINE)]

    assert what_would_help(CARRY, bids, away) == "robot3 or robot4 back in service"


@pytest.mark.parametrize(
    ("carries", "words"),
    [
        ((100.0, 100.0, -1.0, -1.0), "a robot that does GPAB"),
        ((100.0, 100.0, 2.0, 2.0), "a robot that carries 40 kg with its arm"),
        ((), ""),
    ],
    ids=["no arm", "too weak", "it does not say"],
)
@pytest.mark.parametrize("has_refused", [True, False])
def test_a_robot_out_of_service_that_could_not_do_it_is_not_named(carries, words, has_refused):
    away = [status("robot3", carries=carries)]
    bids = [bid("robot3", MAX_COST, "service")] if has_refused and carries else []

    assert what_would_help(CARRY, bids, away) == words


def test_a_robot_that_could_do_it_and_has_not_answered_is_named():
    silent = [status("robot2", RobotState.IDLE)]

    assert what_would_help(CARRY, [], silent) == "an answer from robot2"


def test_what_a_robot_has_bid_counts_more_than_its_status():
    bids = [bid("robot2", MAX_COST, "charge")]

    assert what_would_help(CARRY, bids, [status("robot2", RobotState.IDLE)]) == (
        "more charge for robot2"
    )
