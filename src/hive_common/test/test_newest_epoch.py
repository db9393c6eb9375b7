# SPDX-License-Identifier: BSD-3-Clause
"""Which traffic planner is believed."""

from hive_common.newest_epoch import SILENCE, NewestEpoch


def test_a_planner_counts_until_a_newer_one_is_heard():
    newest = NewestEpoch()

    assert newest.admits(1000, 0.0)
    assert newest.admits(2000, 1.0)
    assert newest.admits(2000, 2.0)
    assert not newest.admits(1000, 3.0)


def test_a_hive_that_counts_from_the_beginning_is_heard_once_the_old_one_is_silent():
    newest = NewestEpoch()
    newest.admits(9000, 0.0)

    assert not newest.admits(1000, SILENCE - 0.1)
    assert newest.admits(1000, SILENCE)
    assert newest.admits(1001, SILENCE + 1.0)


def test_a_simulation_that_was_set_back_counts_from_the_beginning():
    newest = NewestEpoch()
    newest.admits(9000, 500.0)

    assert newest.admits(1000, 0.0)
