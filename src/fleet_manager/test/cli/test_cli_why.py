# SPDX-License-Identifier: BSD-3-Clause
"""`hive why` and `hive replay`, on what members have recorded in a folder."""

import contextlib
import json
from dataclasses import replace

import pytest

from blackboard.auction.decision import Decision
from blackboard.auction.decision_log import ENDING, SqliteBook
from blackboard.domain.bid import MAX_COST, Bid, CostTerms
from fleet_manager.cli.context import CliContext
from fleet_manager.cli.main import run

LEARNED = {"duration": 41.2, "formula_duration": 55.0, "formula_energy_cost": 0.025}
NEAR = Bid(
    *("robot1", "T7", 0.52),
    eta=300.0,
    terms=CostTerms(0.02, 39.5, 1, 8.25, 300.0, added_charge=0.02),
    learned_from=34,
    **LEARNED,
)
SOON = Bid(
    *("robot2", "T7", 0.71),
    eta=30.0,
    terms=CostTerms(0.03, 38.0, 2, 12.0, 30.0, added_charge=0.03),
    duration=20.0,
)
EMPTY = Bid(
    *("robot3", "T7", MAX_COST),
    reason="its charge could fall to 8%",
    exclusion="charge",
    learned_from=34,
    **LEARNED,
)

EXCHANGED = "exchanged: T5 from robot1 to robot2, T9 from robot2 to robot1"

SPLIT = "split into 3 parts of 100 kg, because robot1 carries most, 100 kg"
WEAK = Bid("robot1", "T9", MAX_COST, reason="carries at most 100 kg, not 300 kg")


@pytest.fixture
def hive(tmp_path, capsys):
    """Run the command line on a folder with two recorded decisions on T7."""
    book = SqliteBook(tmp_path / f"blackboard{ENDING}")
    reason = "nobody can take it now: robot3: its charge could fall to 8%; what would help: ..."
    book.note([
        Decision("T7", 1, 4, 1, 10.0, "", reason, (EMPTY,)),
        Decision("T7", 1, 5, 2, 12.5, "robot1", "", (NEAR, SOON, EMPTY), ("robot4",)),
        Decision("T5", 1, 6, 1, 14.0, "robot2", EXCHANGED, (NEAR, SOON)),
        Decision("T9.2", 1, 1, 1, 2.0, "robot3"),
        Decision("T9", 1, 7, 1, 15.0, "", SPLIT, (WEAK,), parts=("T9.1", "T9.2", "T9.3")),
        Decision("T9.1", 1, 7, 1, 15.0, "", f"a part of T9, which was {SPLIT}"),
        Decision("T9.1", 1, 7, 2, 15.5, "robot1", "", (replace(NEAR, task_id="T9.1"),)),
        Decision("T9.3", 1, 7, 1, 15.0, "", f"a part of T9, which was {SPLIT}"),
        Decision("T9.3", 1, 8, 1, 16.0, "", SPLIT, parts=("T9.3.1", "T9.3.2")),
    ])  # fmt: skip
    book.close()

    def call(*words):
        code = run(CliContext(lambda _: contextlib.nullcontext(), lambda: tmp_path), list(words))
        out, err = capsys.readouterr()
        return code, out, err

    return call


def test_why_tells_the_last_decision_with_all_bids_the_cheapest_first(hive):
    code, out, err = hive("why", "T7")

    lines = out.splitlines()
    assert code == 0
    assert lines[0] == (
        "T7 at 12.5 s, auction 1/5, round 2: was given to robot1; no answer from robot4"
    )
    assert [line.split()[0] for line in lines[1:]] == ["ROBOT", "robot1", "robot2", "robot3"]
    assert lines[2].split() == [
        "robot1", "0.52", "8.2", "m", "1", "0.020", "Ah", "39.5", "Ah", "300", "s",
        "41", "s", "34", "drives;", "formula:", "55", "s,", "0.025", "Ah",
    ]  # fmt: skip
    assert lines[4].endswith("its charge could fall to 8%")
    assert err == "1 earlier: hive why T7 --all\n"


@pytest.mark.parametrize("words", [("why", "T7"), ("replay", "T7", "--model", "time")])
def test_each_prediction_is_told_with_what_it_was_made_by_but_not_of_a_robot_that_cannot(
    hive, words
):
    _, out, _ = hive(*words)

    head, *rows = out.splitlines()[1:]
    first, last = head.index("TASK ALONE"), head.index("REASON")
    assert {row.split()[0]: row[first:last].strip().split(maxsplit=2) for row in rows} == {
        "robot1": ["41", "s", "34 drives; formula: 55 s, 0.025 Ah"],
        "robot2": ["20", "s", "formula"],
        "robot3": ["–", "–"],
    }


def test_why_and_replay_tell_that_a_task_was_exchanged_whatever_was_bid(hive):
    _, why, _ = hive("why", "T5")
    _, replay, _ = hive("replay", "T5", "--model", "energy")

    assert why.startswith(f"T5 at 14.0 s, auction 1/6, round 1: was given to robot2 ({EXCHANGED})")
    assert f"it did not go to the lowest bid: {EXCHANGED}" in replay


def test_why_tells_all_decisions_oldest_first(hive):
    _, out, _ = hive("why", "T7", "--all")

    assert out.startswith("T7 at 10.0 s, auction 1/4, round 1: nobody can take it now")
    assert "T7 at 12.5 s" in out


def test_why_prints_plain_data_for_programs(hive):
    _, out, _ = hive("why", "T7", "--all", "--json")

    first, second = json.loads(out)
    assert (first["winner"], second["winner"]) == ("", "robot1")
    assert second["bids"][0]["terms"]["way"] == 8.25


def test_why_tells_of_a_split_task_why_it_was_split_and_which_robot_got_which_part(hive):
    code, out, _ = hive("why", "T9")

    lines = out.splitlines()
    assert code == 0
    assert lines[0] == f"T9 at 15.0 s, auction 1/7, round 1: {SPLIT}"
    assert lines[2].startswith("robot1")
    assert [line.split() for line in lines[3:5]] == [
        ["PART", "ROBOT", "REASON"],
        ["T9.1", "robot1"],
    ]
    assert lines[5].split()[:2] == ["T9.2", "–"]
    assert lines[6].endswith(SPLIT)


def test_why_tells_of_a_part_as_of_any_task(hive):
    code, out, err = hive("why", "T9.1")

    assert code == 0
    assert out.startswith("T9.1 at 15.5 s, auction 1/7, round 2: was given to robot1\n")
    assert err == "1 earlier: hive why T9.1 --all\n"


def test_what_nobody_has_recorded_is_said_with_the_folder(hive, tmp_path):
    code, out, err = hive("why", "T8")

    assert (code, out) == (1, "")
    assert err == (
        f"hive: nothing is recorded about T8 in {tmp_path}; name another folder with --journal\n"
    )


def test_replay_says_who_would_have_got_it_by_another_model(hive):
    code, out, _ = hive("replay", "T7", "--model", "time")

    lines = out.splitlines()
    assert (code, lines[0]) == (0, "T7 by time: robot2 instead of robot1")
    assert [line.split()[0] for line in lines[2:]] == ["robot2", "robot1", "robot3"]


def test_replay_says_where_nothing_would_have_changed(hive):
    _, out, _ = hive("replay", "T7", "--model", "energy")

    assert out.startswith("T7 by energy: robot1 all the same\n")


def test_replay_knows_only_models_that_there_are(hive):
    code, _, err = hive("replay", "T7", "--model", "luck")

    assert code == 2
    assert "latency" in err
