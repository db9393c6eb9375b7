# SPDX-License-Identifier: BSD-3-Clause
"""Elections after the leader's process was proved dead, to some members earlier than to others."""

from blackboard.consensus.log import Entry, Log, Position, Snapshot
from blackboard.consensus.member import Member, Role
from blackboard.consensus.messages import Ballot, BallotKind, Heartbeat
from blackboard.consensus.step import Died, step
from blackboard.domain.settings import RaftSettings

MEMBERS = ("blackboard#1", "robot1#1", "robot2#1")
HEAD = Position(1, 1)
DEATH = Died("blackboard", 2)


def follower(number):
    """Return a member that has just heard the leader, the first in rank to follow it being 1."""
    log = Log.of(Snapshot(HEAD, members=MEMBERS))
    member = Member(MEMBERS[number], RaftSettings(), log, epoch=2, hive="h")
    heartbeat = Heartbeat(2, "blackboard", "robot1", version=1, hive="h")
    return step(member, heartbeat, 10.0)[0]


def tell(member, messages, kind, now):
    """Tell a member the only message of a kind; return what it becomes and says."""
    (ballot,) = [each for each in messages if isinstance(each, Ballot) and each.kind is kind]
    return step(member, ballot, now)


def test_who_gets_its_proof_after_it_was_asked_answers_again():
    first, asks = step(follower(1), DEATH, 10.03)
    second, refuses = tell(follower(2), asks, BallotKind.PRE_VOTE, 10.031)
    first, _ = tell(first, refuses, BallotKind.PRE_VOTE_REPLY, 10.032)
    assert first.role is Role.PRE_CANDIDATE

    second, grants = step(second, DEATH, 10.06)
    first, asks = tell(first, grants, BallotKind.PRE_VOTE_REPLY, 10.061)
    second, votes = tell(second, asks, BallotKind.VOTE, 10.062)
    first, _ = tell(first, votes, BallotKind.VOTE_REPLY, 10.063)

    assert first.role is Role.LEADER


def test_it_is_answered_once():
    _, asks = step(follower(1), DEATH, 10.03)
    second, _ = tell(follower(2), asks, BallotKind.PRE_VOTE, 10.031)
    second, _ = step(second, DEATH, 10.06)

    assert step(second, DEATH, 10.07) == (second.evolve(died=10.07), [])


def test_who_was_granted_at_once_is_not_answered_again():
    _, asks = step(follower(1), DEATH, 10.03)
    second, _ = step(follower(2), DEATH, 10.03)
    second, grants = tell(second, asks, BallotKind.PRE_VOTE, 10.031)

    assert [each.granted for each in grants] == [True]
    assert second.refused is None


def test_whoever_lacks_an_entry_is_refused_with_a_proof_too():
    _, asks = step(follower(1), DEATH, 10.03)
    second = follower(2)
    second = second.evolve(log=second.log.append(Entry(2, 2)))
    second, _ = tell(second, asks, BallotKind.PRE_VOTE, 10.031)
    _, answers = step(second, DEATH, 10.06)

    assert [each.granted for each in answers if each.kind is BallotKind.PRE_VOTE_REPLY] == [False]
