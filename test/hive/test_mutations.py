# SPDX-License-Identifier: BSD-3-Clause
"""The simulation can fail: each rule of the protocol, left out, breaks a property for some seed.

The table in docs/protocol.md lists these mutations. A seed replays with
`python3 -m blackboard.simulation.run SEED`, which finds nothing as long as the rule is there.
"""

from dataclasses import replace

import pytest

from blackboard import active, consensus, election, member
from blackboard.backup import _TOPICS, Backup
from blackboard.consensus import Write
from blackboard.simulation.hive import Disk
from blackboard.simulation.run import run
from blackboard.simulation.schedule import draw


def vote_twice_in_an_epoch(patch):
    # Who has given a vote does not look for another active one either; both rules go.
    patch.setattr(election, "misses_active", lambda *_: True)
    patch.setattr(election, "has_vote_for", lambda *_: True)


def vote_for_any_list(patch):
    patch.setattr(election, "is_up_to_date", lambda *_: True)


def vote_although_the_active_one_is_heard(patch):
    patch.setattr(election, "misses_active", lambda *_: True)


def vote_at_once_after_a_restart(patch):
    restore = Backup._restore  # noqa: SLF001  (the mutation wraps it)

    def hasty(self, durable):
        return restore(self, durable).but(quiet_until=float("-inf"), heard=float("-inf"))

    patch.setattr(Backup, "_restore", hasty)


def drop_the_journal(patch):
    patch.setattr(Disk, "load", lambda _: None)


def keep_the_name_when_the_disk_is_lost(patch):
    init = Backup.__init__

    def same_life(self, talker, name, settings, journal, random, **options):
        init(self, talker, name, settings, journal, random, **options)
        self._member = self._member.but(id=f"{name}#always")

    patch.setattr(Backup, "__init__", same_life)


def answer_before_writing_to_disk(patch):
    def hasty(self, event):
        before = self._member
        after, said = consensus.step(before, event, self._talker.now())
        for message in said:
            self._talker.publish(_TOPICS[type(message)], message)
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


def commit_what_an_earlier_epoch_left(patch):
    def by_count(log, _, held, majority):
        return max(log.committed, sorted(held, reverse=True)[majority - 1])

    patch.setattr(active, "committed_version", by_count)


def go_on_without_a_majority(patch):
    patch.setattr(active, "has_lease", lambda *_: True)
    patch.setattr(consensus, "has_lease", lambda *_: True)


def ignore_epochs(patch):
    # A member of an earlier epoch has long stepped down by itself; it has to be kept from that.
    go_on_without_a_majority(patch)

    def heed(state, epoch, speaker, now):
        if speaker == member.name_of(state.id):
            return None
        state = member.adopt(state, epoch) if epoch != state.epoch else state
        return member.follow(state).but(active=speaker, heard=now, died=None)

    patch.setattr(consensus, "_heed", heed)


def count_the_answer_not_the_question(patch):
    hear_ack = active.hear_ack

    def late(state, ack, now):
        return hear_ack(state, replace(ack, echo=now), now)

    patch.setattr(active, "hear_ack", late)


def change_members_without_waiting(patch):
    patch.setattr(active, "may_change_members", lambda *_: True)


def forget_reports_over_a_restart(patch):
    patch.setattr(Disk, "load_reports", lambda _: ())


def forget_the_vote_over_a_restart(patch):
    # To sit out after a restart hides it.
    vote_at_once_after_a_restart(patch)

    def forgetful(disk):
        return disk.durable and replace(disk.durable, vote="")

    patch.setattr(Disk, "load", forgetful)


CAUGHT_BY = {
    vote_for_any_list: 1,
    vote_although_the_active_one_is_heard: 135,
    drop_the_journal: 5,
    announce_before_a_majority_holds_it: 0,
    commit_with_half_of_the_members: 0,
    elect_with_half_of_the_members: 1,
    answer_before_writing_to_disk: 181,
    go_on_without_a_majority: 216,
    forget_reports_over_a_restart: 192,
}
"""For each mutation a seed whose schedule shows what it breaks."""


@pytest.mark.parametrize("mutate", CAUGHT_BY, ids=lambda mutate: mutate.__name__)
def test_a_rule_that_is_left_out_breaks_a_property(mutate, monkeypatch):
    schedule = draw(CAUGHT_BY[mutate])
    assert run(schedule).violation == ""

    mutate(monkeypatch)

    assert run(schedule).violation != ""
