# SPDX-License-Identifier: BSD-3-Clause
"""The messages that the members of a hive send to each other.

Each says the sender's epoch and the id of the hive. `to` names the members that need the message,
None means all; it tells the talker whom to leave out, and is not transmitted.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.consensus.log import Entry, Position, Snapshot

MAX_EPOCH_JUMP = 100_000
"""A message whose epoch is further ahead than this comes from a faulty sender. A member that
believed it would ignore the real leader for ever."""


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """Announces the leader of an epoch to everyone (message BbBackup).

    Attributes:
        leader: Its name.
        backup: Name of the member that campaigns first when the leader dies; empty while failover
            is off.
        members: Names of all whose votes count, the leader included.
        progress: Grows by one with every heartbeat.
        version: Of the task list, as far as it is committed.
        sent: When the leader sent it, by its own clock [s]; acknowledgements repeat it.
        heard: For each robot, the `RobotStatus.sent` of the last status that renews its lease [s].
        robot_lease: How long a robot may work after that, by its own clock [s].
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
    """Entries that the leader sends to the others (message BbEntries).

    Attributes:
        leader: Its id.
        before: Position of the log entry before the first of `entries`.
        committed: Version up to which the log is committed.
        sent: When the leader sent it, by its own clock [s]; acknowledgements repeat it.
        snapshot: The state at `before`, for members whose log does not reach that far.
    """

    epoch: int
    leader: str
    before: Position
    entries: tuple[Entry, ...]
    committed: int
    sent: float
    snapshot: Snapshot | None = None
    hive: str = ""
    to: tuple[str, ...] | None = field(default=None, compare=False)

    @property
    def last_version(self) -> int:
        """Version of the last entry in it."""
        return self.before.version + len(self.entries)


@dataclass(frozen=True, slots=True)
class AppendReply:
    """Tells the leader how much of its log a member has on disk (message BbAck).

    Attributes:
        member: Id of the sender.
        epoch: The highest epoch it has seen.
        version: Up to which its log agrees with the log of this epoch's leader.
        echo: `sent` of the message it answers [s].
        hive: Empty while the sender belongs to none.
        voter: Whether the sender is willing to lead; a learner gets no vote.
    """

    member: str
    epoch: int
    version: int
    echo: float
    hive: str = ""
    voter: bool = True
    to: tuple[str, ...] | None = field(default=None, compare=False)


class BallotKind(IntEnum):
    """What a ballot is."""

    PRE_VOTE = 0
    """Would you vote for me?"""
    PRE_VOTE_REPLY = 1
    VOTE = 2
    """Vote for me."""
    VOTE_REPLY = 3


@dataclass(frozen=True, slots=True)
class Ballot:
    """A request for a vote or pre-vote, or the reply to one (message BbVote).

    Attributes:
        epoch: In which the candidate wants to lead.
        candidate: Its id.
        member: Id of the sender.
        position: End of the sender's log.
        granted: Whether a reply grants the vote.
        seen: The highest epoch that the sender has seen.
    """

    kind: BallotKind
    epoch: int
    candidate: str
    member: str
    position: Position
    granted: bool = False
    seen: int = 0
    hive: str = ""
    to: tuple[str, ...] | None = field(default=None, compare=False)


Message = Heartbeat | AppendEntries | AppendReply | Ballot
"""Everything that one member may send to another."""
