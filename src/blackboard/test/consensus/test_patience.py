# SPDX-License-Identifier: BSD-3-Clause
"""How long members wait for a silent leader, and how long that leader may act."""

import pytest

from blackboard.consensus.log import Log, Position, Snapshot
from blackboard.consensus.member import Member, Role, has_lease
from blackboard.consensus.messages import AppendReply, Ballot, BallotKind, Heartbeat
from blackboard.consensus.step import HalfTick, Tick, step
from blackboard.domain.settings import RaftSettings
from blackboard.errors import SettingsError

MEMBERS = ("blackboard#1", "robot1#1", "robot2#1")
BEAT, SHARE = 0.2, 1.8 / 2.2
HEAD = Position(1, 1)


class Leader:
    """The blackboard node since it was elected at 0 s, and members that answer after a delay."""

    def __init__(self, members=MEMBERS):
        log = Log.of(Snapshot(HEAD, members=members))
        candidate = Member(
            *(MEMBERS[0], RaftSettings(), log, 2, MEMBERS[0], Role.CANDIDATE),
            votes=frozenset(members[:1]),
            hive="h",
        )
        vote = Ballot(BallotKind.VOTE_REPLY, 2, MEMBERS[0], members[-1], HEAD, True, 2, "h")
        self.member, _ = step(candidate, vote, 0.0)
        self.others = members[1:]
        self.beats = 0

    def beat(self, delay=0.0, promise=2.2):
        """Send a heartbeat, which the others answer after a delay [s]; return it."""
        self.beats += 1
        sent = self.beats * BEAT
        self.member, messages = step(self.member, Tick(0.0), sent)
        for each in self.others:
            answer = AppendReply(each, 2, 2, sent, "h", promise=promise)
            self.member, _ = step(self.member, answer, sent + delay)
        return next(each for each in messages if isinstance(each, Heartbeat))

    def asks(self, seconds, delay=0.0):
        """Return the patience it asks for after some time in which all answer [s]."""
        return [self.beat(delay).patience for _ in range(round(seconds / BEAT))][-1]


def follower(**fields):
    """Return a member that has heard nobody in epoch 2 yet."""
    log = Log.of(Snapshot(HEAD, members=MEMBERS))
    return Member(MEMBERS[1], RaftSettings(), log, epoch=2, hive="h", **fields)


def hear(member, now, patience):
    """Return a member after a heartbeat, and what it has promised."""
    member, (answer,) = step(member, Heartbeat(2, "blackboard", hive="h", patience=patience), now)
    return member, answer.promise


def test_a_new_leader_asks_for_all_patience_until_it_knows_the_links():
    leader = Leader()

    assert leader.asks(4.8) == 2.2
    assert leader.asks(1.0) == pytest.approx(0.6)


def test_slow_answers_are_remembered_for_a_minute_or_two():
    leader = Leader()
    leader.asks(6.0)
    leader.beats += 2  # Two periods pass without an answer.

    assert leader.beat().patience == pytest.approx(3 * 3 * BEAT)
    assert leader.asks(60.0) == pytest.approx(3 * 3 * BEAT)
    assert leader.asks(70.0) == pytest.approx(0.6)


def test_no_leader_asks_for_more_than_the_setting():
    leader = Leader()
    leader.asks(6.0)
    leader.beats += 6

    assert leader.beat().patience == 2.2


def test_two_members_that_cannot_elect_another_leader_are_patient():
    assert Leader(MEMBERS[:2]).asks(20.0) == 2.2


def test_a_leader_acts_for_its_share_of_what_was_promised():
    leader = Leader()
    for _ in range(30):
        leader.beat(promise=0.7)
    sent = leader.beats * BEAT

    assert has_lease(leader.member, sent + 0.99 * SHARE * 0.7)
    assert not has_lease(leader.member, sent + 1.01 * SHARE * 0.7)


def test_a_longer_promise_from_before_still_counts():
    leader = Leader()
    leader.beat(promise=2.2)
    leader.beat(promise=0.7)

    assert has_lease(leader.member, BEAT + 0.99 * SHARE * 2.2)


def test_a_longer_promise_that_is_told_late_counts_from_when_it_was_made():
    leader = Leader()
    for _ in range(30):
        leader.beat(promise=0.7)
    sent = leader.beats * BEAT
    for each in leader.others:
        late = AppendReply(each, 2, 2, sent - 2.0, "h", promise=2.2)
        leader.member, _ = step(leader.member, late, sent)

    assert not has_lease(leader.member, sent + 1.01 * SHARE * 0.7)


def test_a_promise_beyond_the_setting_counts_as_the_setting():
    leader = Leader()
    for _ in range(10):
        leader.beat(promise=1e9)

    assert not has_lease(leader.member, leader.beats * BEAT + 1.81)


def test_a_leader_that_no_majority_has_answered_says_so_again_after_half_a_period():
    leader = Leader()
    leader.beat()
    _, silent = step(leader.member, HalfTick(), 1.5 * BEAT)
    member, (beat, *_) = step(leader.member, Tick(0.0), 2 * BEAT)
    _, (again,) = step(member, HalfTick(), 2.5 * BEAT)

    assert silent == []
    assert (again.sent, again.progress, again.to) == (2.5 * BEAT, beat.progress, beat.to)


def test_only_a_leader_says_anything_after_half_a_period():
    assert step(follower(), HalfTick(), 5.0) == (follower(), [])


@pytest.mark.parametrize(
    ("asked", "promised"), [(0.7, 0.7), (0.0, 2.2), (0.001, 0.6), (99.0, 2.2)]
)
def test_a_member_promises_what_it_is_asked_for_within_the_settings(asked, promised):
    _, promise = hear(follower(), 10.0, asked)

    assert promise == promised


def test_a_member_keeps_the_longer_of_two_promises():
    member, _ = hear(follower(), 10.0, 2.2)
    member, _ = hear(member, 10.2, 0.6)

    assert member.loyal_until == 12.2


def test_a_vote_is_a_promise_of_the_whole_time_whatever_the_last_leader_asked_for():
    member, _ = hear(follower(), 10.0, 0.6)
    ballot = Ballot(BallotKind.VOTE, 3, MEMBERS[2], MEMBERS[2], HEAD, seen=3, hive="h")
    member, _ = step(member, ballot, 11.0)

    assert (member.vote, member.loyal_until) == (MEMBERS[2], 13.2)


def test_a_member_stands_for_election_once_its_promise_is_over():
    member, _ = hear(follower(), 10.0, 0.6)
    _, early = step(member, Tick(0.0), 10.6)
    _, due = step(member, Tick(0.0), 10.7 + member.settings.stagger)

    assert early == []
    assert [each.kind for each in due] == [BallotKind.PRE_VOTE]


def test_the_least_patience_is_at_most_the_usual_one():
    with pytest.raises(SettingsError, match="min_election is 3 s; allowed: at most election"):
        RaftSettings(min_election=3.0)
