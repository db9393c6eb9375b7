# SPDX-License-Identifier: BSD-3-Clause
"""What a member does not listen to: other hives, and blackboards whose time is over.

Every hive has an id, drawn when it was founded, and its members put it into what they say to each
other and to robots. Nothing passes from one hive to another; the one with fewer members gives way
while it hears the other (see docs/decisions/024).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from blackboard.consensus.bootstrap import Handover, newcomer
from blackboard.consensus.member import Role, name_of
from blackboard.consensus.messages import AppendEntries, AppendReply, Heartbeat, Message
from blackboard.domain.talker import BB_ACK, SYNC

if TYPE_CHECKING:
    from collections.abc import Callable
    from random import Random

    from blackboard.consensus.bootstrap import Founding
    from blackboard.consensus.journal import HardState
    from blackboard.consensus.member import Member
    from blackboard.consensus.task_list import TaskList
    from blackboard.domain.talker import Talker


class HiveFilter(Protocol):
    """The member beside a robot: says whom the robot obeys, and what the hive has committed."""

    @property
    def hive(self) -> str:
        """The id of the robot's hive; empty where it belongs to none yet."""

    @property
    def leader(self) -> tuple[str, ...] | None:
        """Name of the member that carries the blackboard; None where that is not known."""

    @property
    def carriers(self) -> tuple[str, ...] | None:
        """Names of that member and its backup; None where they are not known."""

    def obeys(self, hive: str, epoch: int) -> bool:
        """Return whether the blackboard of a hive and an epoch is to be obeyed."""

    def follow(self, hear: Callable[[TaskList], None]) -> None:
        """Have the committed task list handed over soon after every change."""

    def show(self) -> None:
        """Have the list handed over soon although nothing has changed."""


class NoFilter:
    """Obeys everybody, and takes the list from `bb_sync`: no member is beside the robot.

    Args:
        talker: How it hears.
    """

    hive = ""

    def __init__(self, talker: Talker) -> None:
        self._talker = talker
        self.leader: tuple[str, ...] | None = None
        self.carriers: tuple[str, ...] | None = None

    def obeys(self, _hive: str, _epoch: int) -> bool:
        """Return that it is to be obeyed."""
        return True

    def follow(self, hear: Callable[[TaskList], None]) -> None:
        """Have every list handed over that the blackboard tells."""
        self._talker.subscribe(SYNC, hear)

    def show(self) -> None:
        """Do nothing: the blackboard tells the list again when a report is repeated."""


class MemberFilter:
    """Keeps other hives' messages out, and knows whether its own hive has to give way.

    Args:
        talker: How it warns and knows the time.
        name: Of the member.
        patience: A hive that was not heard for longer needs no way [s].

    Attributes:
        founding: While this member waits whether it has to found a hive.
    """

    def __init__(self, talker: Talker, name: str, patience: float) -> None:
        self._talker = talker
        self._name = name
        self._patience = patience
        self._greater: tuple[str, float] | None = None
        self._own_size = 0
        self._handover: Handover | None = None
        self._told: set[str] = set()
        self.founding: Founding | None = None

    def lets_in(self, message: Message, own: Member) -> bool:
        """Return whether a message concerns this member; note what is another hive's.

        A newcomer joins the hive of the first active one that it hears.
        """
        if not own.hive:
            if isinstance(message, Heartbeat | AppendEntries):
                return True
            if message.hive and self.founding is not None:
                self.founding.hear(message.hive)
            return False
        if message.hive == own.hive:
            if isinstance(message, Heartbeat):
                self._own_size = len(message.members)
            return not isinstance(message, AppendReply) or own.role is Role.LEADER
        if message.hive and isinstance(message, Heartbeat):
            self._meet(message, own)
        elif isinstance(message, AppendReply) and not message.hive:
            self._greet(message, own)
        return False

    def makes_way_for(self) -> str:
        """Return the id of the hive to which this one has to give way now; empty if to none."""
        if self._greater is None:
            return ""
        hive, heard = self._greater
        return hive if self._talker.now() - heard < self._patience else ""

    def gives_way(self, own: Member) -> bool:
        """Return whether the hive has to give way; who may leave it gets ready to join the other.

        A lone founder may, and so may a member without a vote, on which nobody counts.
        """
        to = self.makes_way_for()
        if not to:
            self._end_handover()
            return False
        if self._handover is None and _may_leave(own):
            records = own.log.latest.records.values() if own.members == (own.id,) else ()
            self._handover = Handover(self._talker, self._name, to, records)
        return True

    def join(self, random: Random) -> HardState | None:
        """Go on with handing over, called at every heartbeat while a hive gives way.

        Returns:
            What it begins anew with once the other hive has all a lone founder's tasks; else None.
        """
        if self._handover is None:
            return None
        self._handover.beat()
        if not self._handover.is_done:
            return None
        hive = self.makes_way_for()
        self._end_handover()
        self._greater = None
        return newcomer(self._name, random, hive)

    def refuses(self, hive: str, epoch: int, own: Member) -> bool:
        """Return whether a blackboard is of another hive or of an epoch that is over."""
        if hive == own.hive and epoch >= own.epoch:
            return False
        kind = f"epoch {epoch}"
        if kind not in self._told and hive == own.hive:
            self._told.add(kind)
            self._talker.warn(
                f"{name_of(own.id)} refuses what the blackboard of epoch {epoch} says, because "
                f"epoch {own.epoch} has begun"
            )
        return True

    def _greet(self, founder: AppendReply, own: Member) -> None:
        """Let one who waits whether it has to found a hive know that there is one."""
        answer = AppendReply(own.id, own.epoch, 0, 0.0, own.hive, own.voter)
        self._talker.publish(BB_ACK, answer, (name_of(founder.member),))

    def _end_handover(self) -> None:
        if self._handover is not None:
            self._handover.end()
        self._handover = None

    def _meet(self, beat: Heartbeat, own: Member) -> None:
        """Find out which of two hives gives way, and say so once."""
        size = len(own.members) if own.id in own.members else self._own_size
        gives_way = (len(beat.members), beat.hive) > (size, own.hive)
        if gives_way:
            self._greater = beat.hive, self._talker.now()
        if beat.hive in self._told:
            return
        self._told.add(beat.hive)
        mine = ", ".join(map(name_of, own.members)) or "nobody yet"
        if not gives_way:
            then = "the other one gives way"
        elif _may_leave(own):
            then = "its own hive is smaller, so it gives way and joins the other"
        else:
            then = (
                "its own hive is smaller and decides nothing while the other is heard. To have a "
                "member join the other, end it, move its journal away and start it again"
            )
        self._talker.warn(
            f"{name_of(own.id)} belongs to hive {own.hive} ({mine}) and hears hive {beat.hive} "
            f"({', '.join(beat.members)}), which {beat.leader} carries; {then}"
        )


def _may_leave(own: Member) -> bool:
    """Return whether a member may join another hive: nobody else has to count on its disk."""
    return own.members == (own.id,) or own.id not in own.members
