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

from hive_common.map_id import NO_MAP, MapId

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.consensus.log import Entry, Position, Snapshot

MAX_EPOCH_JUMP = 100_000
"""A message whose epoch is further ahead than this comes from a faulty sender. A member that
believed it would ignore the real leader for ever."""


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """Announces the leader of an epoch to everyone (message BbBackup)."""

    epoch: int
    leader: str
    # Name of the member that campaigns first when the leader dies; empty while failover is off.
    backup: str = ""
    members: tuple[str, ...] = ()  # names of all whose votes count, the leader included
    progress: int = 0  # grows by one in every period; a heartbeat that is repeated has the same
    version: int = 0  # of the task list, as far as it is committed
    sent: float = 0.0  # when the leader sent it, by its own clock [s]; acknowledgements repeat it
    # For each robot, the `RobotStatus.sent` of the last status that renews its lease [s].
    heard: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    robot_lease: float = 0.0  # how long a robot may work after that, by its own clock [s]
    hive: str = ""
    offline: tuple[str, ...] = ()  # the robots that the leader has heard, and no longer hears
    # The robots that are to leave their chargers to others, once they have charged enough.
    make_room: tuple[str, ...] = ()
    # How long the members wait for the next message before they elect another leader [s]; 0 for
    # as long as the settings say.
    patience: float = 0.0
    map: MapId = NO_MAP  # that the leader uses; without a checksum it uses none
    to: tuple[str, ...] | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class AppendEntries:
    """Entries that the leader sends to the others (message BbEntries)."""

    epoch: int
    leader: str  # its id
    before: Position  # position of the log entry before the first of `entries`
    entries: tuple[Entry, ...]
    committed: int  # version up to which the log is committed
    sent: float  # when the leader sent it, by its own clock [s]; acknowledgements repeat it
    # The state at `before`, for members whose log does not reach that far.
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

    To members of no hive or of a smaller one, it tells that there is this one.
    """

    member: str  # id of the sender
    epoch: int  # the highest epoch it has seen
    # Up to which its log agrees with the log of this epoch's leader; to another hive, its end.
    version: int
    echo: float  # `sent` of the message it answers [s]
    hive: str = ""  # empty while the sender belongs to none
    voter: bool = True  # whether the sender is willing to lead; a learner gets no vote
    members: int = 0  # how many members have a vote in its hive, as far as it knows
    # For how long after what it answers the sender elects nobody else, by its own clock [s].
    promise: float = 0.0
    to: tuple[str, ...] | None = field(default=None, compare=False)


class BallotKind(IntEnum):
    """What a ballot is."""

    PRE_VOTE = 0  # would you vote for me?
    PRE_VOTE_REPLY = 1
    VOTE = 2  # vote for me
    VOTE_REPLY = 3


@dataclass(frozen=True, slots=True)
class Ballot:
    """A request for a vote or pre-vote, or the reply to one (message BbVote)."""

    kind: BallotKind
    epoch: int  # in which the candidate wants to lead
    candidate: str  # its id
    member: str  # id of the sender
    position: Position  # end of the sender's log
    granted: bool = False  # whether a reply grants the vote
    seen: int = 0  # the highest epoch that the sender has seen
    hive: str = ""
    to: tuple[str, ...] | None = field(default=None, compare=False)


Message = Heartbeat | AppendEntries | AppendReply | Ballot
"""Everything that one member may send to another."""
