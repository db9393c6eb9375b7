# SPDX-License-Identifier: BSD-3-Clause
"""An exception that a message causes ends the handling of that message, and nothing else."""

import pytest

from blackboard.board.reception import FAIL_STOP, MAX_FAILURES, MAX_INPUT, Reception
from blackboard.domain.talker import BACKUP, BB_ACK, BB_ENTRIES, BB_VOTE, TASK_CANCEL


def same(message):
    return message


def fail(_):
    raise KeyError("nobody thought of this")


@pytest.fixture
def said():
    return []


@pytest.fixture
def reception(said):
    return Reception(said.append)


def test_a_handler_that_fails_keeps_the_message_from_no_other(reception):
    heard = []
    reception.hand(TASK_CANCEL, "T1", [fail, heard.append])

    assert heard == ["T1"]
    assert reception.failures.by_topic() == {TASK_CANCEL: 1}


def test_a_failure_is_logged_once_with_the_message_and_the_place(reception, said):
    for _ in range(10):
        reception.hand(TASK_CANCEL, "T1", [fail])

    assert len(said) == 2
    assert "KeyError: 'nobody thought of this'" in said[0]
    assert "a defect of the hive, please report it" in said[0]
    assert "The message: 'T1'" in said[0]
    assert 'raise KeyError("nobody thought of this")' in said[0]
    assert said[1].endswith("10 times so far")


def test_only_the_beginning_of_a_long_message_is_logged(reception, said):
    reception.hand(TASK_CANCEL, "x" * 10_000_000, [fail])

    assert len(said[0]) < MAX_INPUT + 2000
    assert "and 9999002 more characters" in said[0]


def test_many_different_failures_are_counted_and_do_not_fill_the_log(reception, said):
    kinds = [type(f"Error{number}", (Exception,), {}) for number in range(MAX_FAILURES + 50)]
    for kind in kinds:

        def fail_so(_, kind=kind):
            raise kind

        reception.hand(TASK_CANCEL, "T1", [fail_so])

    assert len(said) == MAX_FAILURES
    assert reception.failures.total == MAX_FAILURES + 50


@pytest.mark.parametrize("topic", [BACKUP, BB_ENTRIES, BB_ACK, BB_VOTE])
def test_the_steps_of_the_consensus_are_fail_stop(reception, topic):
    with pytest.raises(KeyError):
        reception.hand(topic, "a message of the consensus", [fail])

    assert topic in FAIL_STOP


@pytest.mark.parametrize("topic", [TASK_CANCEL, BB_ENTRIES])
def test_a_message_that_cannot_be_decoded_is_refused_on_any_topic(reception, topic):
    assert reception.read(topic, b"\xff", bytes.decode) is None
    assert reception.refusals.total == 1
    assert reception.failures.total == 0


@pytest.mark.parametrize("topic", [TASK_CANCEL, BB_ENTRIES])
def test_an_unexpected_exception_while_decoding_costs_the_message_on_any_topic(reception, topic):
    assert reception.read(topic, "T1", fail) is None
    assert reception.failures.by_topic() == {topic: 1}


def test_a_value_is_handed_over_unless_a_check_refuses_it(reception):
    assert reception.read(TASK_CANCEL, "T1", same) == "T1"
    assert reception.read(TASK_CANCEL, "T1", same, lambda _: "not now") is None
    assert reception.read(TASK_CANCEL, "x" * 10_000, same) is None
    assert reception.refusals.total == 2
