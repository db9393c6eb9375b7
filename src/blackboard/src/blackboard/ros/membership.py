# SPDX-License-Identifier: BSD-3-Clause
"""Makes a node a member of the hive: a journal, a `RaftNode` and, for voters, a blackboard."""

from __future__ import annotations

import random
from pathlib import Path
from typing import TYPE_CHECKING

import rospy

from blackboard.auction.decision_log import ENDING, SqliteBook
from blackboard.board.blackboard import Blackboard
from blackboard.board.intake import record_flaw
from blackboard.consensus.journal import SqliteJournal, owner_of, unusable
from blackboard.consensus.member import name_of
from blackboard.consensus.no_quorum import NoQuorum
from blackboard.consensus.node import RaftNode
from blackboard.domain.settings import BlackboardSettings, RaftSettings, TrafficSettings
from blackboard.errors import SettingsError
from blackboard.ros.diagnostics import Diagnostics
from blackboard.ros.journals import default_folder, named_folder
from blackboard.ros.no_clock import NoClock
from blackboard.ros.planner_process import keep_planner
from blackboard.ros.search_process import SearchProcess
from hive_common.ros import params

if TYPE_CHECKING:
    from blackboard.domain.record import TaskRecord
    from blackboard.process.talker import MemberTalker
    from blackboard.ros.path_lengths import RosPathLengths

_CHECK_PERIOD = 1.0
"""Time between two checks that the hive has a quorum, and the member the time [s]."""


def open_journal(member: str) -> SqliteJournal:
    """Open the journal of a member, given by its name, in `journal_folder`.

    Raises:
        SettingsError: The parameter is not a text.
        JournalError: The file cannot be used, or has a task that would be refused from any other
            member: an older version may have accepted it.
    """
    path = _file(member, ".sqlite3")
    journal = SqliteJournal(path)
    for record in _records_in(journal):
        if flaw := record_flaw(record):
            journal.close()
            raise unusable(path, record.task.id, flaw)
    if journal.set_aside is not None:
        rospy.logwarn(
            f"{member} could not read its journal and has moved it to "
            f"{journal.set_aside}; it joins the hive as a new member"
        )
    return journal


def _records_in(journal: SqliteJournal) -> list[TaskRecord]:
    """Return all that a member may apply or send."""
    known = journal.load()
    if known is None:
        return []
    entries = [record for entry in known.log.entries for record in entry.records]
    return [*known.log.base.records.values(), *entries]


def _file(member: str, ending: str) -> Path:
    name = member.strip("/").replace("/", "-")
    return journal_folder(member) / f"{name}{ending}"


def hive_beside(member: str, hive: str) -> str:
    """Return what the folder of a member's journal says of the hive that it belonged to.

    Journals of robots beside it may name a hive. A member that bootstraps another one there has
    lost its journal, or the robots' journals are left of another fleet; a person has to say which.

    Args:
        member: The name of a member whose own journal is new.
        hive: Namespace of the hive, ending in a slash.

    Returns:
        Which members belong to which hive, and what to do; empty if there are none.
    """
    found: dict[str, list[str]] = {}
    folder = journal_folder(member)
    for path in sorted(folder.glob("*.sqlite3")):
        owner, known = owner_of(path) or ("", "")
        robot, _, node = name_of(owner).removeprefix(hive).partition("/")
        if known and f"{hive}{robot}/robot" == name_of(owner) and node == "robot":
            found.setdefault(known, []).append(robot)
    if not found:
        return ""
    named = ", ".join(f"{known} ({', '.join(names)})" for known, names in found.items())
    return (
        f"its journal is new, but journals of robots in {folder} name a hive: {named}. It waits "
        "for that hive, and bootstraps no other. If that hive cannot go on without this member, "
        "run: hive recover --force-members. If another fleet ran here before, move those journals "
        "away, or give this fleet a folder of its own (parameter journal)"
    )


def journal_folder(member: str = "") -> Path:
    """Return the folder of a member's journal; by default that of this node.

    Raises:
        SettingsError: The parameter is not a text, or no ROS master answers.

    ROS Parameters: `journal` of the member, or of a namespace above it. Default: `default_folder`.
    """
    try:
        folder = named_folder(member or rospy.get_name())
    except OSError as error:
        raise SettingsError(
            f"the ROS master does not say where the journal is ({error}); start again when it runs"
        ) from None
    return Path(folder) if folder else default_folder()


def join(
    talker: MemberTalker,
    hive: str,
    path_lengths: RosPathLengths,
    journal: SqliteJournal,
    *,
    bootstraps: bool = False,
    stands_by: bool = True,
) -> RaftNode:
    """Make this node a member; the caller starts what is returned once everything is connected.

    All members read the hive's settings where the node `blackboard` does, so they agree.

    Args:
        talker: The member's name, messages and time.
        hive: Namespace of the hive, ending in a slash.
        path_lengths: Where a robot can stand and how far it drives.
        journal: The member's disk.
        bootstraps: Whether it bootstraps a hive where there is none, and where no journal in the
            same folder names one.
        stands_by: Whether it can lead; its process then publishes `VOTER_TOPICS`, else
            `LEARNER_TOPICS`.

    Raises:
        ParameterError: A parameter is not allowed; the text names it.
        JournalError: The file for decisions cannot be used.
    """
    namespace = f"{hive}blackboard"
    beside = ""
    if bootstraps and journal.load() is None:
        beside = hive_beside(talker.name, hive)
    if beside:
        talker.warn(f"{talker.name} does not bootstrap a hive: {beside}")
    node = RaftNode(
        talker,
        talker.name,
        params.read(RaftSettings, namespace),
        journal,
        random.SystemRandom(),
        bootstrap=bootstraps and not beside,
        voter=stands_by,
    )
    path_lengths.follow(node.tell_map)
    if stands_by:
        settings = params.read(BlackboardSettings, namespace)
        lengths_of = path_lengths.of
        log = SqliteBook(_file(talker.name, ENDING))
        searcher = SearchProcess(talker)
        rospy.on_shutdown(searcher.close)
        Blackboard(
            talker,
            node,
            lengths_of(0.0),
            settings,
            note=log.note,
            path_lengths_for=lengths_of,
            searcher=searcher,
        ).start()
        if params.read(TrafficSettings, namespace).traffic == "planned":
            keep_planner(talker, node, hive)
    path = str(_file(talker.name, ".sqlite3"))
    no_quorum = NoQuorum(talker, lambda: node.member, path, beside)
    no_clock = NoClock(talker)
    for watch in (no_quorum, no_clock):
        talker.every(_CHECK_PERIOD, watch.look)
    Diagnostics(talker, node, no_quorum, no_clock).start()
    return node
