# SPDX-License-Identifier: BSD-3-Clause
"""How refused messages are counted and said."""

from blackboard.board.refusals import MAX_REASONS, OTHERS, Refusals


def test_a_reason_is_said_once_and_counted_each_time():
    said = []
    book = Refusals(said.append)
    for _ in range(9):
        book.refuse("new_task", "no goals")

    assert said == ["a message on new_task is refused: no goals"]
    assert book.counts == {("new_task", "no goals"): 9}
    assert book.total == 9


def test_a_reason_that_repeats_is_said_with_growing_gaps():
    said = []
    book = Refusals(said.append)
    for _ in range(1000):
        book.refuse("new_task", "no goals")

    assert said[1:] == [
        "10 messages on new_task were refused so far: no goals",
        "100 messages on new_task were refused so far: no goals",
        "1000 messages on new_task were refused so far: no goals",
    ]


def test_many_different_reasons_neither_fill_the_memory_nor_the_log():
    said = []
    book = Refusals(said.append)
    for number in range(10_000):
        book.refuse("task_state", f"{number} is wrong")

    assert len(book.counts) == MAX_REASONS + 1
    assert book.counts["task_state", OTHERS] == 10_000 - MAX_REASONS
    assert len(said) < MAX_REASONS + 6
    assert book.by_topic() == {"task_state": 10_000}


def test_a_reason_that_quotes_ten_megabytes_is_cut():
    said = []
    Refusals(said.append).refuse("task_state", "x" * 10_000_000)

    assert len(said[0]) < 400
