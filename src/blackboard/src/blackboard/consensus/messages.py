# SPDX-License-Identifier: BSD-3-Clause
"""What the members of a hive send to each other: heartbeats, AppendEntries and votes."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.consensus.log import Entry, Position, Snapshot


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """Who carries the blackboard (message BbBackup).

    Attributes:
        epoch: Grows with every new active blackboard.
        active: Name of the member that carries it.
        backup: Name of the member that stands first when the active one dies; empty when failover
            is off.
        members: Names of all whose votes count, the active one included.
        progress: Grows with every turn of the active blackboard's own queue.
        version: Of the task list, as far as it is committed.
        sent: When it was sent by the active one's own clock [s]; acknowledgements repeat it.
        heard: For each robot, the `RobotStatus.sent` of the last status that renews its lease [s].
        robot_lease: How long a robot may work from that time on [s], by its own clock.
        hive: Id of the hive.
        to: Names of the members that it is meant for, which is not told them; None means all.
    """

    epoch: int
    leader: str
    backup: str = ""
    members: tuple[str, ...] = ()
    progress: int = 0
    version: int = 0
    sent: float = 0.0
    heard: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    robot_lease: float = 0.0
    hive: str = ""
    to: tuple[str, ...] | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class AppendEntries:
    """What the active blackboard has the others write down (message BbEntries).

    Attributes:
        epoch: Of the active blackboard.
        active: Id of the member that carries it.
        before: What the changes follow.
        entries: The changes, without a gap.
        committed: Version up to which everything stays for ever.
        sent: When it was sent by the active one's own clock [s]; acknowledgements repeat it.
        whole: The list at `before`, for those who have no other way to get there.
        hive: Id of the hive.
        to: Names of the members that it is meant for; it is not told them.
    """

    epoch: int
    leader: str
    before: Position
    entries: tuple[Entry, ...]
    committed: int
    sent: float
    snapshot: Snapshot | None = None
    hive: str = ""
    to: tuple[str, ...] = field(default=(), compare=False)

    @property
    def reaches(self) -> int:
        """Version of the last change in it."""
        return self.before.version + len(self.entries)


@dataclass(frozen=True, slots=True)
class AppendReply:
    """What a member has on disk of what the active one wrote (message BbAck).

    Attributes:
        member: Id of the member.
        epoch: The highest it has seen.
        version: Up to which its list is that of the active blackboard of this epoch.
        echo: `sent` of what it answers [s].
        hive: Id of the hive; empty where it belongs to none yet.
        stands_by: Whether it would carry the blackboard; who would not gets no vote.
    """

    member: str
    epoch: int
    version: int
    echo: float
    hive: str = ""
    voter: bool = True


class BallotKind(IntEnum):
    """What a ballot is."""

    PRE_VOTE = 0
    """Would you vote for me?"""
    PRE_VOTE_REPLY = 1
    """I would, or would not."""
    VOTE = 2
    """Vote for me."""
    VOTE_REPLY = 3
    """You have, or have not, my vote."""


@dataclass(frozen=True, slots=True)
class Ballot:
    """A question for votes, or the answer to one (message BbVote).

    Attributes:
        kind: Which of these it is.
        epoch: The one in which the candidate wants to be active.
        candidate: Id of the candidate.
        member: Id of who sends this.
        position: How far the sender's list goes.
        granted: In an answer, whether it is a yes.
        seen: The highest epoch that the sender has seen.
        hive: Id of the hive.
    """

    kind: BallotKind
    epoch: int
    candidate: str
    member: str
    position: Position
    granted: bool = False
    seen: int = 0
    hive: str = ""


Message = Heartbeat | AppendEntries | AppendReply | Ballot
"""Everything that one member may send to another."""
