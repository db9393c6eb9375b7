# SPDX-License-Identifier: BSD-3-Clause
"""How a hive goes on whose majority is gone for good, by the word of a person.

Raft decides nothing without a majority, and a hive cannot know that the others never come back. A
person who knows names a member that is left. It becomes the only one of a hive of its own, with
the task list that is on its disk. This hive's id begins with that of the hive before, so members
of that hive who come back leave it and join, and the two never take each other's messages for
their own. etcd (`--force-new-cluster`) also starts again with one member.
"""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.consensus.bootstrap import new_id
from blackboard.consensus.journal import SqliteJournal
from blackboard.consensus.log import Log
from blackboard.errors import JournalError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path
    from random import Random

    from blackboard.consensus.journal import HardState


def succeeds(hive: str, other: str) -> bool:
    """Return whether a hive is what became of another whose majority was gone."""
    return bool(other) and hive.startswith(f"{other}.")


def newest(disks: Iterable[HardState]) -> HardState:
    """Return the state of the member that lacks the least of what the hive has committed.

    That is the one that Raft would elect: with the last entry of the highest epoch, then with most
    entries. `disks` are states of one hive, or of hives of which each succeeds another.
    """
    return max(disks, key=lambda disk: (len(disk.hive), disk.log.position, disk.member))


def recovered(hard_state: HardState, random: Random) -> HardState:
    """Return a member's state as the only member of the hive that goes on.

    It keeps its entries, also those of which it does not know that they are committed: some were
    announced by a leader that is gone.
    """
    log = hard_state.log
    base = replace(log.base, members=(hard_state.member,))
    entries = tuple(replace(entry, members=None) for entry in log.entries)
    hive = f"{hard_state.hive}.{new_id(random)}"
    return replace(hard_state, vote="", hive=hive, log=Log.of(base, entries, log.committed))


def recover_journal(path: Path, random: Random) -> HardState:
    """Make the member of a journal the only one of the hive that goes on; return its state.

    What its robot has to report and what may be on board stays.

    Raises:
        JournalError: The file cannot be read or written, a member has it open, or its member
            belongs to no hive.
    """
    with closing(SqliteJournal(path, alone=True)) as journal:
        known = journal.load()
        if known is None or not known.hive:
            raise JournalError(f"the journal {path} was not changed: its member has no hive")
        after = recovered(known, random)
        journal.save(after)
    return after
