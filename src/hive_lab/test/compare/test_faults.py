# SPDX-License-Identifier: BSD-3-Clause
"""Faults of a hive on ROS: signals to its processes, when they are due."""

import signal

import pytest

from hive_lab.compare.experiment import Fault
from hive_lab.compare.simulator_run import Faults

PROCESSES = {"/blackboard": 10, "/robot1/robot": 11, "/robot2/robot": 12}


class Hive:
    """Knows the processes of its nodes."""

    def process_of(self, node):
        return PROCESSES[node]


@pytest.fixture
def sent():
    return []


@pytest.fixture
def strike(sent):
    """Return a function that makes faults, whose signals are noted."""
    return lambda *faults: Faults(
        faults, Hive(), lambda process, number: sent.append((process, number))
    )


def test_a_process_is_killed_once_when_its_time_has_come(strike, sent):
    with strike(Fault(after=5, kill="robot1"), Fault(after=3, kill="blackboard")) as faults:
        faults.look(2.9)
        assert sent == []
        faults.look(3.2)
        assert sent == [(10, signal.SIGKILL)]
        faults.look(9.0)
        faults.look(9.5)

    assert sent == [(10, signal.SIGKILL), (11, signal.SIGKILL)]


def test_a_process_stands_still_for_a_while_and_goes_on(strike, sent):
    with strike(Fault(after=3, freeze="robot2", seconds=4)) as faults:
        faults.look(3.0)
        faults.look(6.9)
        assert sent == [(12, signal.SIGSTOP)]
        faults.look(7.0)
        faults.look(8.0)

    assert sent == [(12, signal.SIGSTOP), (12, signal.SIGCONT)]


def test_at_the_end_of_the_run_everything_goes_on_and_nothing_more_fails(strike, sent):
    later = Fault(after=30, kill="blackboard")
    with strike(Fault(after=3, freeze="robot2", seconds=40), later) as faults:
        faults.look(5.0)

    assert sent == [(12, signal.SIGSTOP), (12, signal.SIGCONT)]


def test_a_process_that_has_ended_meanwhile_is_no_mistake(sent):
    def gone(_process, _number):
        sent.append("tried")
        raise ProcessLookupError

    with Faults([Fault(after=3, freeze="robot2", seconds=4)], Hive(), gone) as faults:
        faults.look(3.0)
        faults.look(8.0)

    assert sent == ["tried", "tried"]
