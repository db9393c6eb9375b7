# SPDX-License-Identifier: BSD-3-Clause
"""The simulated disk, which may confirm a write before it would survive a loss of power."""

import random

import pytest

from blackboard.consensus.bootstrap import new_hive, new_member
from blackboard.domain.record import Hold, Load, TaskUpdate
from blackboard.domain.task import TaskState
from hive_lab.fault_schedules.simulated_member import Disk

BEFORE = new_member("robot1", random.Random(1))
AFTER = new_hive(BEFORE.member, "ab")
REPORT = TaskUpdate("T1", TaskState.DONE, robot_id="robot1")
HOLD = Hold((Load("T1", 2.0, "ab", 1),))


@pytest.fixture
def clock():
    return [10.0]


@pytest.fixture
def disk(clock):
    """A disk with a state on it, which confirms writes 0.3 s too early from now on."""
    disk = Disk(now=lambda: clock[0])
    disk.save(BEFORE)
    disk.lag = 0.3
    return disk


def test_a_write_is_lost_with_the_power_as_long_as_it_is_in_the_cache(disk, clock):
    disk.save(AFTER)
    disk.save_reports([REPORT])
    disk.save_hold(HOLD)
    clock[0] += 0.29

    assert disk.after_power_loss == BEFORE
    assert disk.lose_power()
    assert (disk.load(), disk.load_reports(), disk.load_hold()) == (BEFORE, (), Hold())


def test_a_write_survives_a_loss_of_power_after_the_lag(disk, clock):
    disk.save(AFTER)
    clock[0] += 0.2
    disk.save_reports([REPORT])
    clock[0] += 0.2

    assert disk.after_power_loss == AFTER
    assert disk.lose_power()
    assert (disk.load(), disk.load_reports()) == (AFTER, ())


def test_a_process_that_crashes_reads_what_is_in_the_cache(disk):
    disk.save(AFTER)

    assert disk.load() == AFTER


def test_a_disk_that_tells_the_truth_loses_nothing(clock):
    disk = Disk(now=lambda: clock[0])
    disk.save(BEFORE)
    disk.save(AFTER)

    assert not disk.lose_power()
    assert disk.load() == AFTER
