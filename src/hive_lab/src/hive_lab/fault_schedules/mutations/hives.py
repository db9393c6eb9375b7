# SPDX-License-Identifier: BSD-3-Clause
"""Rules about hives that hear each other."""

from dataclasses import replace

import pytest

from blackboard.consensus import hive_filter
from blackboard.consensus.bootstrap import Handover
from blackboard.consensus.hive_filter import MemberFilter
from blackboard.consensus.lease import Lease
from blackboard.consensus.messages import Heartbeat
from hive_lab.fault_schedules.mutations.mutation import Mutation


def listen_to_every_hive(patch):
    patch.setattr(MemberFilter, "accepts", lambda *_: True)
    patch.setattr(MemberFilter, "obeys", lambda _self, _hive, epoch, own: epoch >= own.epoch)


def join_without_handing_over(patch):
    patch.setattr(Handover, "is_done", True)


def give_way_only_to_a_leader(patch):
    compare = MemberFilter._compare

    def deaf(self, message, own):
        if isinstance(message, Heartbeat):
            compare(self, message, own)

    patch.setattr(MemberFilter, "_compare", deaf)


def take_any_list_for_the_other_hives(patch):
    hear_list = Handover._hear_list

    def trusting(self, known):
        hear_list(self, replace(known, hive=self._to))

    patch.setattr(Handover, "_hear_list", trusting)


def stay_without_a_vote_in_a_smaller_hive(patch):
    may_leave = hive_filter._may_leave
    patch.setattr(hive_filter, "_may_leave", lambda own: own.id in own.members and may_leave(own))


def leave_a_hive_whose_robots_have_tasks(patch):
    may_leave = hive_filter._may_leave
    patch.setattr(
        hive_filter, "_may_leave", lambda own: own.members == (own.id,) or may_leave(own)
    )


def leave_for_a_hive_that_is_smaller_by_now(patch):
    pauses = MemberFilter.pauses

    def hasty(self, own):
        with pytest.MonkeyPatch.context() as meanwhile:
            meanwhile.setattr(MemberFilter, "_is_larger", lambda *_: True)
            return pauses(self, own)

    patch.setattr(MemberFilter, "pauses", hasty)


def believe_an_old_size_of_another_hive(patch):
    compare = MemberFilter._compare

    def trusting(self, message, own):
        self._committed.clear()
        compare(self, message, own)

    patch.setattr(MemberFilter, "_compare", trusting)


def wait_for_an_epoch_of_the_hive_before(patch):
    begin_anew = Lease.begin_anew

    def stubborn(self, now):
        epoch = self._epoch
        begin_anew(self, now)
        self._epoch = epoch

    patch.setattr(Lease, "begin_anew", stubborn)


MUTATIONS = (
    Mutation(listen_to_every_hive, (0, "a founder alone"), over_zenoh=2),
    Mutation(join_without_handing_over, (51, "lost disks"), over_zenoh=1),
    Mutation(give_way_only_to_a_leader, "second hive", bug="second hive"),
    Mutation(
        take_any_list_for_the_other_hives, (1, "a founder alone"), bug="3073", over_zenoh=None
    ),
    Mutation(stay_without_a_vote_in_a_smaller_hive, "a short-lived hive", bug="3153"),
    Mutation(leave_a_hive_whose_robots_have_tasks, "a busy robot", bug="68373"),
    Mutation(
        leave_for_a_hive_that_is_smaller_by_now,
        "swapped hives",
        bug="swapped hives",
        over_zenoh=None,
    ),
    Mutation(believe_an_old_size_of_another_hive, "an old size", bug="35199"),
    Mutation(wait_for_an_epoch_of_the_hive_before, "another hive", bug="7979"),
)
