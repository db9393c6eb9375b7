# SPDX-License-Identifier: BSD-3-Clause
"""Rules about hives that a person recovers."""

from dataclasses import replace

from blackboard.consensus.hive_filter import MemberFilter
from blackboard.consensus.recovery import recovered, succeeds
from hive_lab.fault_schedules import rescue
from hive_lab.fault_schedules.mutations.mutation import Mutation


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


MUTATIONS = (
    Mutation(keep_the_id_of_a_recovered_hive, "recovered too soon"),
    Mutation(stay_in_a_hive_that_was_recovered, "recovered"),
    Mutation(leave_a_hive_that_has_had_a_leader, "recovered beside a majority"),
    Mutation(recover_with_the_oldest_list, (158, "no majority left"), over_zenoh=158),
)
