# SPDX-License-Identifier: BSD-3-Clause
"""Each rule about hives that a person recovers prevents what a schedule shows.

docs/protocol.md has the table of all these changes.
"""

from dataclasses import replace

import pytest

from blackboard.consensus.hive_filter import MemberFilter
from blackboard.consensus.recovery import recovered, succeeds
from hive_lab.fault_schedules import rescue


def keep_the_id_of_a_recovered_hive(patch):
    def same(hard_state, random):
        return replace(recovered(hard_state, random), hive=hard_state.hive)

    patch.setattr(rescue, "recovered", same)


def stay_in_a_hive_that_was_recovered(patch):
    patch.setattr(MemberFilter, "_is_recovered", lambda *_: False)


def leave_a_hive_that_has_had_a_leader(patch):
    def rash(_self, own, other):
        return succeeds(other, own.hive)

    patch.setattr(MemberFilter, "_is_recovered", rash)


def recover_with_the_oldest_list(patch):
    patch.setattr(rescue, "newest", lambda disks: min(disks, key=lambda disk: disk.log.position))


CAUGHT_BY = {
    keep_the_id_of_a_recovered_hive: "recovered too soon",
    stay_in_a_hive_that_was_recovered: "recovered",
    leave_a_hive_that_has_had_a_leader: "recovered beside a majority",
    recover_with_the_oldest_list: (158, "no majority left"),
}
"""For each mutation the schedule that shows what it breaks: a name, or a seed and a scenario."""


@pytest.mark.parametrize("mutate", CAUGHT_BY, ids=lambda mutate: mutate.__name__)
def test_without_the_rule_a_schedule_breaks_a_property(mutate, caught):
    assert caught(mutate, CAUGHT_BY[mutate])
