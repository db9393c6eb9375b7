# SPDX-License-Identifier: BSD-3-Clause
# ruff: noqa: SLF001  (a mutation reaches inside)
"""The simulation can fail: each rule of the protocol, left out, breaks a property for some seed.

The table in docs/protocol.md lists these mutations. A seed replays with
`python3 -m blackboard.simulation.run SEED --mood MOOD`, which finds nothing as long as the rule is
there.
"""

from dataclasses import replace

import pytest

from blackboard import active, backup, consensus, election
from blackboard.backup import _TOPICS, Backup
from blackboard.consensus import Write
from blackboard.election import BallotKind
from blackboard.fence import Border
from blackboard.lease import Lease, Leases
from blackboard.leave import Leave
from blackboard.member import name_of
from blackboard.pose import Pose
from blackboard.reports import Reports
from blackboard.settings import BackupSettings
from blackboard.simulation.draw import draw
from blackboard.simulation.hive import Disk
from blackboard.simulation.run import run
from blackboard.simulation.schedule import (
    BLACKBOARD,
    OPERATOR,
    Crash,
    Cut,
    Moment,
    Point,
    Post,
    Schedule,
    Strike,
)
from blackboard.task import Task, TaskType
from blackboard.watch import Watch


def vote_for_any_list(patch):
    patch.setattr(election, "is_up_to_date", lambda *_: True)


def vote_although_the_active_one_is_heard(patch):
    patch.setattr(election, "misses_active", lambda *_: True)


def vote_twice_in_an_epoch(patch):
    patch.setattr(election, "has_vote_for", lambda *_: True)


def do_not_take_a_vote_for_a_promise(patch):
    hear_question = election.hear_question

    def loose(member, ballot, now):
        after, said = hear_question(member, ballot, now)
        if after.vote != member.vote and after.vote:
            after = after.but(heard=member.heard, active=member.active)
        return after, said

    patch.setattr(election, "hear_question", loose)


def forget_the_vote_over_a_restart(patch):
    load = Disk.load

    def forgetful(self):
        durable = load(self)
        return durable and replace(durable, vote="", epoch=durable.log.position.epoch)

    patch.setattr(Disk, "load", forgetful)


def vote_at_once_after_a_restart(patch):
    awake = backup.awake

    def hasty(durable, settings, now):
        return awake(durable, settings, now).but(heard=float("-inf"), quiet_until=float("-inf"))

    patch.setattr(backup, "awake", hasty)


def obey_an_active_one_of_any_epoch(patch):
    heed = consensus._heed

    def meek(member, epoch, speaker, hive, now):
        return heed(member, max(epoch, member.epoch), speaker, hive, now)

    patch.setattr(consensus, "_heed", meek)


def count_answers_of_any_epoch(patch):
    hear_ack, hear_answer = active.hear_ack, election.hear_answer

    def count_ack(member, ack, now):
        return hear_ack(member, replace(ack, epoch=member.epoch), now)

    def count_vote(member, ballot, now):
        if ballot.kind is BallotKind.ANSWER:
            ballot = replace(ballot, epoch=member.epoch)
        return hear_answer(member, ballot, now)

    patch.setattr(active, "hear_ack", count_ack)
    patch.setattr(election, "hear_answer", count_vote)


def ignore_epochs(patch):
    obey_an_active_one_of_any_epoch(patch)
    count_answers_of_any_epoch(patch)
    patch.setattr(Border, "refuses", lambda *_: False)


def count_a_vote_however_late(patch):
    hear_answer = election.hear_answer
    patch.setattr(
        election,
        "hear_answer",
        lambda member, ballot, _: hear_answer(member, ballot, member.asked),
    )


def count_when_an_answer_came(patch):
    hear_ack = active.hear_ack

    def generous(member, ack, now):
        return hear_ack(member, replace(ack, echo=now), now)

    patch.setattr(active, "hear_ack", generous)


def commit_by_count_what_an_earlier_epoch_left(patch):
    def count(log, _, held, majority):
        return max(log.committed, sorted(held, reverse=True)[majority - 1])

    patch.setattr(active, "committed_version", count)


def change_members_without_waiting(patch):
    patch.setattr(active, "may_change_members", lambda *_: True)


def keep_the_id_when_the_disk_is_lost(patch):
    awake = backup.awake

    def same(durable, settings, now):
        return awake(replace(durable, member=name_of(durable.member)), settings, now)

    patch.setattr(backup, "awake", same)


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


def renew_a_lease_after_its_end(patch):
    def generous(self, beat, now):
        if self._robot_id not in dict(beat.heard):
            return False
        self._length = beat.robot_lease
        before, self._end = self._end, now + beat.robot_lease
        return self._end > before

    patch.setattr(Lease, "renew", generous)


def reassign_before_the_lease_has_ended(patch):
    patch.setattr(Leases, "is_lost", lambda self, robot, now: self.unheard_for(robot, now) > 1.5)


def count_leases_from_before_the_takeover(patch):
    begin = Watch.begin

    def hasty(self):
        begin(self)
        self._leases = Leases(self._settings.reassign, since=float("-inf"))

    patch.setattr(Watch, "begin", hasty)


def by_hand(*faults, stagger=0.25):
    """Return a schedule of the blackboard node and two robots."""
    post = Post(8.0, Task("T1", TaskType.GA, (Pose(1.0, 2.0),)))
    settings = BackupSettings(kept_changes=4, stagger=stagger)
    return Schedule(SEED, 2, (post, *faults), settings)


SEED = 19
TELLS_NOBODY = Strike(13.0, Moment.TAKES_OVER, Cut(0.0, (), 10.0), Point.BEFORE_SAYING)
RIVALS = (
    Cut(12.0, (BLACKBOARD,), 3.0, others=("robot1",)),
    Cut(12.0, (BLACKBOARD,), 20.0, others=("robot2",)),
    Cut(12.0, ("robot1",), 5.6, one_way=True, others=("robot2",), holds=True),
    TELLS_NOBODY,
)
"""Both the blackboard node and robot2 ask robot1 for its vote in epoch 2. The blackboard node wins
and can tell nobody; robot2 learns only then that robot1 would have voted for it, and stands."""

LATE_VOTE = by_hand(
    Cut(12.0, (BLACKBOARD,), 12.0),
    Cut(12.0, ("robot1",), 5.5, others=("robot2",)),
    Strike(16.0, Moment.STANDS, Cut(0.0, (), 2.5, one_way=True, holds=True), Point.BEFORE_SAYING),
    stagger=3.5,
)
"""A question for a vote arrives 2.5 s after it was asked."""

FIGURE_8 = by_hand(
    Cut(12.0, (BLACKBOARD, OPERATOR), 4.0),
    Post(12.5, Task("T2", TaskType.GA, (Pose(1.0, 2.0),))),
    Strike(12.6, Moment.TAKES_OVER, Crash(0.0, "", 6.0), Point.BEFORE_SAYING),
    Strike(16.0, Moment.WRITES, Cut(0.0, (), 3.0)),
    Crash(19.0, BLACKBOARD, 12.0),
)
"""Figure 8 of the Raft paper: a change of epoch 1 reaches a majority in epoch 3, and a member that
holds another one of epoch 2 in its place is elected in epoch 4."""

STORM, LATE, RESTARTS = "election storm", "late messages", "quick restarts"
CHURN, DISKS, ANY = "members come and go", "lost disks", ""

CAUGHT_BY = {
    vote_for_any_list: (30, STORM),
    vote_although_the_active_one_is_heard: (7, STORM),
    vote_twice_in_an_epoch: by_hand(*RIVALS),
    do_not_take_a_vote_for_a_promise: (8, STORM),
    forget_the_vote_over_a_restart: by_hand(
        *RIVALS, Strike(13.0, Moment.VOTES, Crash(0.0, "", 0.05))
    ),
    vote_at_once_after_a_restart: (2, RESTARTS),
    elect_with_half_of_the_members: (1, STORM),
    count_a_vote_however_late: LATE_VOTE,
    ignore_epochs: (6, LATE),
    obey_an_active_one_of_any_epoch: (36, LATE),
    commit_with_half_of_the_members: (0, STORM),
    announce_before_a_majority_holds_it: (0, STORM),
    answer_before_writing_to_disk: (375, STORM),
    acknowledge_what_is_missing: (0, STORM),
    keep_what_the_new_active_one_lacks: (6, STORM),
    go_on_without_a_majority: (0, STORM),
    count_when_an_answer_came: (35, LATE),
    commit_by_count_what_an_earlier_epoch_left: FIGURE_8,
    change_members_without_waiting: (39, CHURN),
    keep_the_id_when_the_disk_is_lost: (1, DISKS),
    drop_the_journal: (0, STORM),
    forget_reports_over_a_restart: (4, ANY),
    forget_who_has_reported: (0, STORM),
    carry_out_an_order_again: (20, ANY),
    work_on_without_a_lease: (327, STORM),
    renew_a_lease_after_its_end: (34, ANY),
    reassign_before_the_lease_has_ended: (28, ANY),
    count_leases_from_before_the_takeover: (3, STORM),
}
"""For each mutation a schedule that shows what it breaks, or the seed and the mood of one."""


@pytest.mark.parametrize("mutate", CAUGHT_BY, ids=lambda mutate: mutate.__name__)
def test_a_rule_that_is_left_out_breaks_a_property(mutate, monkeypatch):
    known = CAUGHT_BY[mutate]
    schedule = known if isinstance(known, Schedule) else draw(*known)
    if schedule is FIGURE_8:
        monkeypatch.setattr(active, "MOST_ENTRIES", 1)  # else the changes come in one message
    assert run(schedule).violation == ""

    mutate(monkeypatch)

    assert run(schedule).violation != ""
