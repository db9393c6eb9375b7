# SPDX-License-Identifier: BSD-3-Clause

"""Rules of retention: without any of them, some schedule breaks a property.

As in `test_mutations_of_elections`; docs/protocol.md lists these mutations too.
"""

import pytest

from blackboard.auction.splitting import part_ids
from blackboard.board import retention
from blackboard.board.blackboard import Blackboard
from blackboard.board.orders import Orders
from blackboard.board.unsplitting import Unsplitting
from blackboard.domain.record import TaskRecord


def forget_what_has_not_ended(patch):
    everything = lambda records: {name: [name] for name in records}  # noqa: E731  (one rule in one line)
    patch.setattr(retention, "ended_families", everything)


def forget_before_the_end_is_committed(patch):
    commit = Blackboard._commit  # noqa: SLF001  (the rule is in it)

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

CAUGHT_BY = {
    forget_what_has_not_ended: (1, ANY),
    forget_before_the_end_is_committed: (14, "election storm"),
    number_what_is_posted_anew_from_one: "posted anew",
    do_not_say_that_a_task_is_forgotten: "posted anew",
    join_parts_whatever_robots_do_with_them: (0, "a strong robot comes and goes"),
}
"""For each mutation the schedule that shows what it breaks: a name, or a seed and a scenario."""


@pytest.mark.parametrize("mutate", CAUGHT_BY, ids=lambda mutate: mutate.__name__)
def test_without_the_rule_a_schedule_breaks_a_property(mutate, caught):
    assert caught(mutate, CAUGHT_BY[mutate])
