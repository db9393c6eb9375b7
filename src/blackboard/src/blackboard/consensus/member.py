# SPDX-License-Identifier: BSD-3-Clause
"""The Raft state of one member of the hive.

A member is the blackboard node or a robot's process. Its id is its name, then `#`, then an id of
its disk. A member that lost its disk gets a new id, because it no longer knows how it voted
(docs/decisions/020).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from blackboard.consensus.log import Log
    from blackboard.consensus.messages import Ballot, Message
    from blackboard.domain.settings import RaftSettings


class Role(Enum):
    """The Raft role of a member."""

    FOLLOWER = "follower"
    # Asks the others whether they miss the leader too, before it begins a new epoch.
    PRE_CANDIDATE = "pre-candidate"
    CANDIDATE = "candidate"
    LEADER = "leader"


@dataclass(frozen=True, slots=True)
class Peer:
    """What the leader knows of another member."""

    version: int = 0  # up to which it has the log on disk (Raft's matchIndex)
    echo: float = float("-inf")  # when the last message was sent that it has answered [s]
    # Until when it elects nobody else, by the leader's clock however slow that is [s].
    until: float = float("-inf")
    heard: float = float("-inf")  # when it was last heard [s]
    voter: bool = True  # whether it is willing to lead; a learner is not
    sent: int = 0  # version of the last entry sent to it (Raft's nextIndex - 1)
    # No later than when the first entry was sent that it has not acknowledged [s].
    sent_at: float = float("-inf")


UNKNOWN_PEER = Peer()
"""A member that the leader has not heard yet."""


@dataclass(frozen=True, slots=True)
class Contacts:
    """How old a majority's last answer has become of late, while this member leads.

    Two periods are kept: the one under way, and the one before.
    """

    before: float  # the oldest in the period before [s]
    now: float = 0.0  # the oldest in this period so far [s]
    ends: float = 0.0  # when this period ends [s]

    @property
    def oldest(self) -> float:
        """The oldest of late [s]."""
        return max(self.before, self.now)


@dataclass(frozen=True)
class Member:
    """The state of one member; only `step.step` changes it."""

    id: str  # its name and the id of its disk
    settings: RaftSettings
    log: Log
    epoch: int = 0  # the highest epoch it has seen (Raft's term)
    vote: str = ""  # id of the candidate it voted for in this epoch
    role: Role = Role.FOLLOWER
    leader: str = ""  # name of the leader it last heard, or of the candidate it last voted for
    backup: str = ""  # name of the member that the leader has named as its successor
    heard: float = float("-inf")  # when it last heard the leader [s]
    # For how long the leader has asked it to wait for the next message [s]; 0 before it has.
    patience: float = 0.0
    loyal_until: float = float("-inf")  # it has promised to elect nobody else before then [s]
    died: float | None = None  # when the leader's process was proved dead [s]; None if it was not
    refused: Ballot | None = None  # the last request for a pre-vote that it has refused
    quiet_until: float = float("-inf")  # until then it neither votes nor campaigns [s]
    retry: float = float("-inf")  # it does not campaign again before then [s]
    jitter: float = 0.0  # random share of `stagger` that it adds to its delay, 0 to 1
    version: int = 0  # up to which its log agrees with the log of this epoch's leader
    # Ids of the members that granted it their vote or pre-vote.
    votes: frozenset[str] = frozenset()
    asked: float = 0.0  # when it requested votes [s]
    # The other members by id, while it leads.
    peers: Mapping[str, Peer] = field(default_factory=lambda: MappingProxyType({}))
    in_flight: int = 0  # version of the last entry sent to the voters, while it leads
    progress: int = 0  # heartbeat periods so far
    beat: float = float("-inf")  # when it sent the last one [s]
    contacts: Contacts = Contacts(0.0)  # of a leader with the others
    hive: str = ""  # id of its hive; empty while it belongs to none
    voter: bool = True  # whether it is willing to lead; a learner only holds the log

    def evolve(self, **changes: object) -> Member:
        """Return a copy with some fields changed.

        `dataclasses.replace` runs `__init__`, which takes most of the time of a long simulation.
        """
        changed = object.__new__(Member)
        changed.__dict__.update(self.__dict__, **changes)
        return changed

    @property
    def members(self) -> tuple[str, ...]:
        """Ids of the members whose votes count, as far as this one knows."""
        return self.log.latest.members


Step = tuple[Member, list["Message"]]
"""The state of a member after an event, and the messages it sends once that state is on disk."""


def name_of(member_id: str) -> str:
    """Return the name in a member's id."""
    return member_id.partition("#")[0]


def is_majority(voters: Iterable[str], members: tuple[str, ...]) -> bool:
    """Return whether the voters among the members are more than half of them."""
    return sum(voter in members for voter in set(voters)) >= majority_of(members)


def majority_of(members: tuple[str, ...]) -> int:
    """Return the smallest number of members that is more than half of them."""
    return len(members) // 2 + 1


def enter_epoch(member: Member, epoch: int) -> Member:
    """Become a follower in a higher epoch, in which the member has not voted yet."""
    version = member.log.committed
    return become_follower(member.evolve(epoch=epoch, vote="", version=version, patience=0.0))


def be_loyal(member: Member, now: float) -> Member:
    """Promise to elect nobody else as long as the leader has asked for, which is heard now."""
    until = now + patience_of(member)
    return member.evolve(heard=now, died=None, loyal_until=max(member.loyal_until, until))


def patience_of(member: Member) -> float:
    """Return for how long a member waits for the leader's next message [s]."""
    least, most = member.settings.min_election, member.settings.election
    return min(max(member.patience, least), most) if member.patience else most


def lease_of(settings: RaftSettings, promise: float) -> float:
    """Return how long a leader may act after it sent what was answered by a promise [s].

    Whoever promised waits for `promise` [s] by its own clock. The leader's share of that is that
    of `self_demotion` in `election`, so that its clock may be slow and the other fast.
    """
    return min(promise, settings.election) * settings.self_demotion / settings.election


def become_follower(member: Member) -> Member:
    """Stop campaigning or leading."""
    return member.evolve(role=Role.FOLLOWER, votes=frozenset(), peers=MappingProxyType({}))


def has_lease(member: Member, now: float) -> bool:
    """Return whether a leader holds the leader lease: a majority elects nobody else now."""
    return now <= _nth(member, now, lambda peer: peer.until)


def last_majority_contact(member: Member, now: float) -> float:
    """Return when the leader sent what a majority, itself included, has answered by now [s].

    The time of sending counts, not that of the answer. A member that answers grants nobody its
    vote for a while after it heard the message, which is later than the leader sent it.
    """
    return _nth(member, now, lambda peer: peer.echo)


def _nth(member: Member, own: float, time_of: Callable[[Peer], float]) -> float:
    """Return the latest time that a majority reaches; this member's is its `own` [s]."""
    times = [
        own if each == member.id else time_of(member.peers.get(each, UNKNOWN_PEER))
        for each in member.members
    ]
    return sorted(times, reverse=True)[majority_of(member.members) - 1]
