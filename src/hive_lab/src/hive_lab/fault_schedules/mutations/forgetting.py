# SPDX-License-Identifier: BSD-3-Clause
"""Rules about tasks that the list forgets."""

from blackboard.auction.splitting import part_ids
from blackboard.board import retention
from blackboard.board.blackboard import Blackboard
from blackboard.board.orders import Orders
from blackboard.board.unsplitting import Unsplitting
from blackboard.domain.record import TaskRecord
from hive_lab.fault_schedules.mutations.mutation import Mutation


def forget_what_has_not_ended(patch):
    everything = lambda records: {name: [name] for name in records}  # noqa: E731  (one rule in one line)
    patch.setattr(retention, "ended_families", everything)


def forget_before_the_end_is_committed(patch):
    commit = Blackboard._commit

    def hasty(self, *records, **others):
        commit(self, *records, **others)
        ended = (record.task.id for record in records if record.state.is_terminal)
        self._node.forget(tuple(ended))

    patch.setattr(Blackboard, "_commit", hasty)


def number_what_is_posted_anew_from_one(patch):
    def new(task, _earlier, reason="", parent=""):
        return TaskRecord(task, reason=reason, parent=parent)

    patch.setattr(TaskRecord, "new", new)


def do_not_say_that_a_task_is_forgotten(patch):
    patch.setattr(Orders, "disown", lambda *_: None)


def join_parts_whatever_robots_do_with_them(patch):
    def parts(self, whole, _):
        known = map(self._node.get, part_ids(whole))
        return tuple(part for part in known if part is not None)

    patch.setattr(Unsplitting, "_parts_not_begun", parts)


ANY = ""

MUTATIONS = (
    Mutation(forget_what_has_not_ended, (1, ANY), over_zenoh=1),
    Mutation(forget_before_the_end_is_committed, (14, "election storm"), over_zenoh=14),
    Mutation(number_what_is_posted_anew_from_one, "posted anew", over_zenoh=None),
    Mutation(do_not_say_that_a_task_is_forgotten, "posted anew"),
    Mutation(join_parts_whatever_robots_do_with_them, (0, "a strong robot comes and goes")),
)
