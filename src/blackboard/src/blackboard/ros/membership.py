# SPDX-License-Identifier: BSD-3-Clause
"""What makes a node a member of the hive: a disk, a `RaftNode`, and a blackboard that stands by."""

from __future__ import annotations

import random
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import rosgraph
import rosgraph.network
import rospkg
import rospy

from blackboard.auction.decision_log import ENDING, SqliteBook
from blackboard.board.blackboard import Blackboard
from blackboard.consensus.journal import SqliteJournal
from blackboard.consensus.no_quorum import NoQuorum
from blackboard.consensus.node import RaftNode
from blackboard.domain import talker as topics
from blackboard.domain.settings import BlackboardSettings, RaftSettings
from blackboard.errors import SettingsError
from blackboard.ros import params
from blackboard.ros.diagnostics import Diagnostics

if TYPE_CHECKING:
    from blackboard.ros.path_lengths import RosPathLengths
    from blackboard.ros.talker import RosTalker

SPEAKS = (
    topics.NEW_TASK,
    topics.TASK_BROADCAST,
    topics.TASK_ASSIGN,
    topics.TASK_STATE,
    topics.ROBOT_STATUS,
    topics.BACKUP,
    topics.SYNC,
    topics.BB_ENTRIES,
    topics.BB_ACK,
    topics.BB_VOTE,
)
"""What a member may have to publish; all of it is advertised before it has to."""

SPEAKS_ASIDE = (topics.TASK_STATE, topics.ROBOT_STATUS, topics.BB_ACK)
"""The same for a robot that would not carry the blackboard."""

_LOOK_EVERY = 1.0
"""Time between two looks whether the hive stands still [s]."""


def open_journal() -> SqliteJournal:
    """Open this node's journal in the folder that the parameters name.

    Raises:
        SettingsError: The parameter is no text.
        JournalError: The file cannot be used.

    ROS Parameters: `~journal`, else `journal` of the hive: the folder. Default: a folder of this
        ROS master below ROS_HOME.
    """
    journal = SqliteJournal(_file(".sqlite3"))
    if journal.set_aside is not None:
        rospy.logwarn(
            f"{rospy.get_name()} could not read its journal and has moved it to "
            f"{journal.set_aside}; it joins the hive as a new member"
        )
    return journal


def _file(ending: str) -> Path:
    """Return the path of a file of this node in the folder that the parameters name."""
    name = rospy.get_name().strip("/").replace("/", "-")
    return journal_folder() / f"{name}{ending}"


def journal_folder() -> Path:
    """Return the folder that the parameters name for the journals.

    Raises:
        SettingsError: The parameter is no text.

    ROS Parameters: `~journal`, else `/journal`: the folder. Default: `default_folder`.
    """
    folder = rospy.get_param("~journal", "") or rospy.get_param("/journal", "")
    if not isinstance(folder, str):
        raise SettingsError(f"journal is {folder!r}; allowed: the path of a folder")
    return Path(folder) if folder else default_folder()


def default_folder() -> Path:
    """Return the folder of the journals where no parameter names one, by the ROS master.

    A machine has several names for itself, and who asks may use another than the nodes.
    """
    address = urlsplit(rosgraph.get_master_uri())
    is_here = rosgraph.network.is_local_address(address.hostname)
    host = "localhost" if is_here else address.hostname
    return Path(rospkg.get_ros_home()) / "robo-hive" / f"{host}-{address.port}"


def join(
    talker: RosTalker,
    hive: str,
    ways: RosPathLengths,
    journal: SqliteJournal,
    *,
    founds: bool = False,
    stands_by: bool = True,
) -> RaftNode:
    """Make this node a member; call `start` of what is returned when all else is wired up.

    The timers of the hive are those of the node `blackboard`, so that all members keep the same.

    Args:
        talker: How it hears and speaks.
        hive: Namespace of the hive, ending in a slash.
        ways: Knows where a robot can stand, and how far it is for each.
        journal: Its disk.
        founds: Whether it founds a hive where there is none.
        stands_by: Whether it would carry the blackboard; the talker has to speak on `SPEAKS` then,
            and else on `SPEAKS_ASIDE`.

    Raises:
        SettingsError: A parameter is not allowed; the text names it.
        JournalError: The file for decisions cannot be used.
    """
    node = f"{hive}blackboard"
    settings = params.read(RaftSettings, node)
    backup = RaftNode(
        talker.steady,
        rospy.get_name(),
        settings,
        journal,
        random.SystemRandom(),
        bootstrap=founds,
        voter=stands_by,
    )
    if stands_by:
        book = SqliteBook(_file(ENDING))
        decides = params.read(BlackboardSettings, node)
        Blackboard(
            talker, backup, ways.of(0.0), decides, note=book.note, path_lengths_for=ways.of
        ).start()
    no_quorum = NoQuorum(talker.steady, lambda: backup.member, str(_file(".sqlite3")))
    talker.steady.every(_LOOK_EVERY, no_quorum.look)
    Diagnostics(talker, backup, no_quorum).start()
    return backup
