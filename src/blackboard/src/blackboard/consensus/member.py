# SPDX-License-Identifier: BSD-3-Clause
"""What one member of the hive knows of the others: the state that election and replication share.

A member is the blackboard node or a robot's process. Its id is its name and, behind a `#`, the
life of its disk: a member whose disk was lost comes back as another, because it has forgotten what
it promised (see docs/decisions/021).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from blackboard.consensus.log import Log
    from blackboard.domain.settings import RaftSettings


class Role(Enum):
    """What a member does."""

    FOLLOWER = "follower"
    """Writes down what the active one says."""
    PRE_CANDIDATE = "asking"
    """Asks the others whether they miss the active one too (the pre-vote)."""
    CANDIDATE = "candidate"
    """Asks the others for their votes."""
    LEADER = "active"
    """Carries the blackboard."""


@dataclass(frozen=True, slots=True)
class Peer:
    """What the active blackboard knows of another member.

    Attributes:
        version: Up to which it has the list on disk.
        echo: When the message was sent that it answered last [s].
        heard: When it was last heard [s].
        stands_by: Whether it would carry the blackboard.
        sent: Up to which version it has been sent the list.
        sent_at: When the first part of that was sent which it has not answered, or earlier [s].
    """

    version: int = 0
    echo: float = float("-inf")
    heard: float = float("-inf")
    voter: bool = True
    sent: int = 0
    sent_at: float = float("-inf")


@dataclass(frozen=True)
class Member:
    """The state of one member; `backup.step` is the function that moves it on.

    Attributes:
        id: Its name and the life of its disk.
        settings: The hive's timers.
        epoch: The highest it has seen; on disk.
        vote: Id of the candidate that has its vote in this epoch; on disk.
        log: The list; on disk.
        role: What it does.
        active: Name of the member that was last heard or voted for as the active one.
        backup: Name of the member that the active one has named its backup.
        heard: When the active one was last heard [s].
        died: When the active one was proved dead [s]; None where it was not.
        quiet_until: Until then it neither votes nor stands [s].
        retry: Not before then does it stand again [s].
        jitter: Its part of the time by which members stand apart, 0 to 1.
        version: Up to which its list is that of the active blackboard of this epoch.
        votes: Ids of those who said yes, while it asks.
        asked: When it asked [s].
        peers: What it knows of the others by id, while it is active.
        flying: Version of the last change that it has sent, while it is active; on its way until
            it is committed.
        progress: Heartbeats so far.
        hive: Id of its hive; empty where it belongs to none yet; on disk.
        stands_by: Whether it would carry the blackboard; who would not holds the list only.
    """

    id: str
    settings: RaftSettings
    log: Log
    epoch: int = 0
    vote: str = ""
    role: Role = Role.FOLLOWER
    leader: str = ""
    backup: str = ""
    heard: float = float("-inf")
    died: float | None = None
    quiet_until: float = float("-inf")
    retry: float = float("-inf")
    jitter: float = 0.0
    version: int = 0
    votes: frozenset[str] = frozenset()
    asked: float = 0.0
    peers: Mapping[str, Peer] = field(default_factory=lambda: MappingProxyType({}))
    in_flight: int = 0
    progress: int = 0
    hive: str = ""
    voter: bool = True

    def but(self, **changes: object) -> Member:
        """Return the same with some fields changed.

        `dataclasses.replace` goes through every field anew, which takes most of the time of a
        simulation that does little else.
        """
        changed = object.__new__(Member)
        changed.__dict__.update(self.__dict__, **changes)
        return changed

    @property
    def members(self) -> tuple[str, ...]:
        """Ids of the members whose votes count, as far as this one knows."""
        return self.log.latest.members


def name_of(member_id: str) -> str:
    """Return the name in a member's id."""
    return member_id.partition("#")[0]


def is_majority(voters: Iterable[str], members: tuple[str, ...]) -> bool:
    """Return whether some members are more than half of all."""
    return sum(voter in members for voter in set(voters)) >= majority_of(members)


def majority_of(members: tuple[str, ...]) -> int:
    """Return how many members are more than half of all."""
    return len(members) // 2 + 1


def adopt(member: Member, epoch: int) -> Member:
    """Enter a higher epoch as a follower; the vote in it is still free."""
    return follow(member.but(epoch=epoch, vote="", version=member.log.committed))


def follow(member: Member) -> Member:
    """Stop to stand or to be active."""
    return member.but(role=Role.FOLLOWER, votes=frozenset(), peers=MappingProxyType({}))


def has_lease(member: Member, now: float) -> bool:
    """Return whether an active member may still act: a majority has followed it of late."""
    return now - followed_since(member, now) <= member.settings.self_demotion


def followed_since(member: Member, now: float) -> float:
    """Return when the active one sent what a majority has answered [s]; itself is one of them.

    The time of sending counts, not that of the answer: a member that answered has promised to
    elect nobody else for a while from when it heard the message, which is later than it was sent.
    """
    nobody = Peer()
    echoes = [
        now if each == member.id else member.peers.get(each, nobody).echo
        for each in member.members
    ]
    return sorted(echoes, reverse=True)[majority_of(member.members) - 1]
