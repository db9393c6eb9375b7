# SPDX-License-Identifier: BSD-3-Clause
"""The simulation can fail: each rule of the protocol, left out, breaks a property for some seed.

The table in docs/protocol.md lists these mutations. A seed replays with
`python3 -m blackboard.simulation.run SEED`, which finds nothing as long as the rule is there.
"""

import pytest

from blackboard import active, consensus, election
from blackboard.backup import _TOPICS, Backup
from blackboard.consensus import Write
from blackboard.lease import Leases
from blackboard.leave import Leave
from blackboard.reports import Reports
from blackboard.simulation.hive import Disk
from blackboard.simulation.run import run
from blackboard.simulation.schedule import draw
from blackboard.watch import Watch


def vote_for_any_list(patch):
    patch.setattr(election, "is_up_to_date", lambda *_: True)


def vote_although_the_active_one_is_heard(patch):
    patch.setattr(election, "misses_active", lambda *_: True)


def drop_the_journal(patch):
    patch.setattr(Disk, "load", lambda _: None)


def answer_before_writing_to_disk(patch):
    def hasty(self, event):
        before = self._member
        after, said = consensus.step(before, event, self._talker.now())
        for message in said:
            self._talker.publish(_TOPICS[type(message)], self._with_leases(message))
        if self._write_down(before, after):
            self._member = after
            self._notice(before, after)

    patch.setattr(Backup, "_step", hasty)


def announce_before_a_majority_holds_it(patch):
    def hasty(self, records, then):
        if self.may_act():
            if records:
                self._step(Write(records))
            then()

    patch.setattr(Backup, "commit", hasty)


def commit_with_half_of_the_members(patch):
    half = lambda members: max(1, len(members) // 2)  # noqa: E731  (one rule in one line)
    patch.setattr(active, "majority_of", half)


def elect_with_half_of_the_members(patch):
    def half(voters, members):
        return sum(voter in members for voter in voters) >= max(1, len(members) // 2)

    patch.setattr(election, "is_majority", half)


def go_on_without_a_majority(patch):
    patch.setattr(active, "has_lease", lambda *_: True)
    patch.setattr(consensus, "has_lease", lambda *_: True)


def forget_reports_over_a_restart(patch):
    patch.setattr(Disk, "load_reports", lambda _: ())


def acknowledge_what_is_missing(patch):
    extend = consensus.extend

    def blind(log, message):
        return extend(log, message) or log

    patch.setattr(consensus, "extend", blind)


def keep_what_the_new_active_one_lacks(patch):
    extend = consensus.extend

    def stubborn(log, message):
        longer = extend(log, message)
        return log if longer and longer.position.version <= log.position.version else longer

    patch.setattr(consensus, "extend", stubborn)


def carry_out_an_order_again(patch):
    patch.setattr(Reports, "answer", lambda *_: False)


def forget_who_has_reported(patch):
    patch.setattr(Reports, "add", lambda self, report: self._talker.publish("task_state", report))


def work_on_without_a_lease(patch):
    patch.setattr(Leave, "holds", lambda _: True)


def reassign_before_the_lease_has_ended(patch):
    patch.setattr(Leases, "is_lost", lambda self, robot, now: self.unheard_for(robot, now) > 1.5)


def count_leases_from_before_the_takeover(patch):
    begin = Watch.begin

    def hasty(self):
        begin(self)
        self._leases = Leases(self._settings.reassign, since=float("-inf"))

    patch.setattr(Watch, "begin", hasty)


CAUGHT_BY = {
    vote_for_any_list: 1,
    vote_although_the_active_one_is_heard: 135,
    elect_with_half_of_the_members: 1,
    commit_with_half_of_the_members: 0,
    announce_before_a_majority_holds_it: 0,
    answer_before_writing_to_disk: 130,
    acknowledge_what_is_missing: 0,
    keep_what_the_new_active_one_lacks: 9,
    go_on_without_a_majority: 359,
    drop_the_journal: 5,
    forget_reports_over_a_restart: 192,
    forget_who_has_reported: 12,
    carry_out_an_order_again: 200,
    work_on_without_a_lease: 24,
    reassign_before_the_lease_has_ended: 14,
    count_leases_from_before_the_takeover: 9,
}
"""For each mutation a seed whose schedule shows what it breaks."""


@pytest.mark.parametrize("mutate", CAUGHT_BY, ids=lambda mutate: mutate.__name__)
def test_a_rule_that_is_left_out_breaks_a_property(mutate, monkeypatch):
    schedule = draw(CAUGHT_BY[mutate])
    assert run(schedule).violation == ""

    mutate(monkeypatch)

    assert run(schedule).violation != ""
