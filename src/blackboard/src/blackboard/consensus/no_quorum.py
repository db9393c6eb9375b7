# SPDX-License-Identifier: BSD-3-Clause
"""Says what a hive waits for that has no active blackboard, and what a person can do.

A hive whose members are gone for good waits for them for ever: whoever went on without a majority
could lose what the others know. The most frequent case is a smaller fleet on the disks of a larger
one that ran on the same ROS master before.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.consensus.member import Role, majority_of, name_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.consensus.member import Member
    from blackboard.domain.talker import Talker

PATIENCE = 10.0
"""Longer than a takeover and the start of a fleet take [s]."""

REPEAT = 30.0
"""Time after which it is said again [s]."""


class NoQuorum:
    """Watches one member for an active blackboard.

    Args:
        talker: Knows the time, by which the member hears the active one, and warns.
        state: Gives the member's state.
        journal: The file with the member's copy of the list.

    Attributes:
        text: What is waited for; empty where nothing is.
    """

    def __init__(self, talker: Talker, state: Callable[[], Member], journal: str) -> None:
        self._talker = talker
        self._state = state
        self._journal = journal
        self._begun = talker.now()
        self._said = float("-inf")
        self.text = ""

    def look(self) -> None:
        """Find out whether the hive stands still, and say so now and then."""
        member, now = self._state(), self._talker.now()
        silence = now - max(member.heard, self._begun)
        if member.role is Role.LEADER or silence < PATIENCE:
            if member.role is Role.LEADER:
                self._begun = now
            self.text = ""
            self._said = float("-inf")
            return
        self.text = self._words(member, silence)
        if now - self._said >= REPEAT:
            self._said = now
            self._talker.warn(self.text)

    def _words(self, member: Member, silence: float) -> str:
        begin = f"{name_of(member.id)} has heard no active blackboard for {silence:.0f} s"
        if not member.members:
            return f"{begin}; start the hive's blackboard node, or look at the network"
        names = ", ".join(map(name_of, member.members))
        return (
            f"{begin}: by its list the hive has {len(member.members)} members ({names}), and "
            f"{majority_of(member.members)} of them have to be there before anything is decided. "
            "Start those that are missing. Where they are gone for good, for example because "
            "another fleet ran here before, give this fleet a new folder with the parameter "
            f"journal, or move the old one away ({self._journal} and those beside it); the tasks "
            "on that list are then forgotten"
        )
