# SPDX-License-Identifier: BSD-3-Clause
"""Makes a node a member of the hive: a journal, a `RaftNode` and, for voters, a blackboard."""

from __future__ import annotations

import random
from pathlib import Path
from typing import TYPE_CHECKING

import rospy

from blackboard.auction.decision_log import ENDING, SqliteBook
from blackboard.board.blackboard import Blackboard
from blackboard.consensus.journal import SqliteJournal
from blackboard.consensus.no_quorum import NoQuorum
from blackboard.consensus.node import RaftNode
from blackboard.domain import talker as topics
from blackboard.domain.settings import BlackboardSettings, RaftSettings
from blackboard.errors import SettingsError
from blackboard.ros.diagnostics import Diagnostics
from blackboard.ros.journals import default_folder
from hive_common.ros import params

if TYPE_CHECKING:
    from blackboard.ros.path_lengths import RosPathLengths
    from blackboard.ros.talker import RosTalker

LEARNER_TOPICS = (topics.TASK_STATE, topics.ROBOT_STATUS, topics.BB_ACK)
"""What a robot that cannot lead may publish."""

VOTER_TOPICS = (
    *LEARNER_TOPICS,
    topics.NEW_TASK,
    topics.TASK_BROADCAST,
    topics.TASK_ASSIGN,
    topics.BACKUP,
    topics.SYNC,
    topics.BB_ENTRIES,
    topics.BB_VOTE,
)
"""What a member that can lead may publish; it advertises all of it before it has to."""

_CHECK_PERIOD = 1.0
"""Time between two checks that the hive has a quorum [s]."""


def open_journal() -> SqliteJournal:
    """Open this node's journal in `journal_folder`.

    Raises:
        SettingsError: The parameter is not a text.
        JournalError: The file cannot be used.
    """
    journal = SqliteJournal(_file(".sqlite3"))
    if journal.set_aside is not None:
        rospy.logwarn(
            f"{rospy.get_name()} could not read its journal and has moved it to "
            f"{journal.set_aside}; it joins the hive as a new member"
        )
    return journal


def _file(ending: str) -> Path:
    name = rospy.get_name().strip("/").replace("/", "-")
    return journal_folder() / f"{name}{ending}"


def journal_folder() -> Path:
    """Return the folder of the journals.

    Raises:
        SettingsError: The parameter is not a text.

    ROS Parameters: `~journal`, else `/journal`. Default: `default_folder`.
    """
    folder = rospy.get_param("~journal", "") or rospy.get_param("/journal", "")
    if not isinstance(folder, str):
        raise SettingsError(f"journal is {folder!r}; allowed: the path of a folder")
    return Path(folder) if folder else default_folder()


def join(
    talker: RosTalker,
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
        talker: Messages and time.
        hive: Namespace of the hive, ending in a slash.
        path_lengths: Where a robot can stand and how far it drives.
        journal: The member's disk.
        bootstraps: Whether it bootstraps a hive where there is none.
        stands_by: Whether it can lead; its talker then publishes `VOTER_TOPICS`, else
            `LEARNER_TOPICS`.

    Raises:
        ParameterError: A parameter is not allowed; the text names it.
        JournalError: The file for decisions cannot be used.
    """
    namespace = f"{hive}blackboard"
    node = RaftNode(
        talker,
        rospy.get_name(),
        params.read(RaftSettings, namespace),
        journal,
        random.SystemRandom(),
        bootstrap=bootstraps,
        voter=stands_by,
    )
    if stands_by:
        settings = params.read(BlackboardSettings, namespace)
        lengths_of = path_lengths.of
        log = SqliteBook(_file(ENDING))
        Blackboard(
            talker, node, lengths_of(0.0), settings, note=log.note, path_lengths_for=lengths_of
        ).start()
    no_quorum = NoQuorum(talker, lambda: node.member, str(_file(".sqlite3")))
    talker.every(_CHECK_PERIOD, no_quorum.look)
    Diagnostics(talker, node, no_quorum).start()
    return node
