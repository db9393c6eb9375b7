# SPDX-License-Identifier: BSD-3-Clause
"""Says what a hive without a leader waits for, and what a person can do.

A hive whose members are gone for good waits for ever: going on without a majority could lose what
the others know. The usual cause is a smaller fleet on the disks of a larger one that ran on the
same ROS master before.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.consensus.member import Role, majority_of, name_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.consensus.member import Member
    from blackboard.domain.talker import Talker

TIMEOUT = 10.0
"""Longer than a failover and the start of a fleet take [s]."""

REPEAT = 30.0
"""Time between two warnings [s]."""


class NoQuorum:
    """Warns while a member hears no leader.

    Args:
        journal: The member's journal file.
        beside: What keeps a member with a new journal from bootstrapping a hive; may be empty.

    Attributes:
        text: What the hive waits for; empty while it waits for nothing.
    """

    def __init__(
        self, talker: Talker, state: Callable[[], Member], journal: str, beside: str = ""
    ) -> None:
        self._talker = talker
        self._state = state
        self._journal = journal
        self._beside = beside
        self._since = talker.now()
        self._warned = float("-inf")
        self.text = ""

    def look(self) -> None:
        """Find out whether the hive waits, and warn now and then."""
        member, now = self._state(), self._talker.now()
        if member.role is Role.LEADER:
            self._since = now
        silence = now - max(member.heard, self._since)
        if silence < TIMEOUT:
            self.text, self._warned = "", float("-inf")
            return
        self.text = self._describe(member, silence)
        if now - self._warned >= REPEAT:
            self._warned = now
            self._talker.warn(self.text)

    def _describe(self, member: Member, silence: float) -> str:
        begin = f"{_short(member.id)} has heard no leader for {silence:.0f} s"
        if not member.members:
            remedy = self._beside or "start the hive's blackboard node, or check the network"
            return f"{begin}; {remedy}"
        names = ", ".join(map(_short, member.members))
        return (
            f"{begin}: the hive has {len(member.members)} members ({names}), and "
            f"{majority_of(member.members)} of them have to run before it decides anything. Start "
            "those that are missing. If too many are gone for good, end the others and have them "
            "go on without: hive recover --force-members. If another fleet ran here before, give "
            "this one a folder of its own (launch argument journal:=FOLDER, or parameter "
            f"journal), or move {self._journal} and the files beside it away; the tasks on that "
            "list are then forgotten"
        )


def _short(member_id: str) -> str:
    """Return a member's name without ROS's leading slash."""
    return name_of(member_id).strip("/")
