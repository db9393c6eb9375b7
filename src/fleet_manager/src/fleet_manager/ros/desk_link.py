# SPDX-License-Identifier: BSD-3-Clause
"""The windows' link to the hive on ROS; see `fleet_manager.desk.facts.DeskLink`.

Whatever may wait (the master, a new publisher, a full socket) waits in the link's own thread and
never in the windows' event loop.
"""

from __future__ import annotations

import contextlib
from threading import Thread
from typing import TYPE_CHECKING

import rospy

from blackboard.auction.decision_log import read_decisions
from blackboard.errors import JournalError, SettingsError
from blackboard.ros.master_watch import MasterState, MasterWatch
from blackboard.ros.membership import journal_folder
from fleet_manager.desk.facts import (
    DecisionRead,
    LinkChange,
    LinkState,
    PlacesKnown,
    ReadDecisions,
    TroublesRead,
    ZonesKnown,
)
from fleet_manager.desk.inbox import Inbox
from fleet_manager.desk.places import Place
from fleet_manager.desk.work import Work
from fleet_manager.ros.hive_topics import HiveTopics
from fleet_manager.ros.map_topics import MapTopics
from fleet_manager.ros.place_parameter import hive_places
from fleet_manager.ros.troubles import Troubles
from hive_common.ros.links import mend_links
from hive_common.ros.zones import zones_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fleet_manager.desk.facts import Command, Fact
    from hive_common.zone import Zone

_LINKS = {MasterState.LOST: LinkState.LOST, MasterState.BACK: LinkState.UP}

_TURN = 0.5  # [s] between two looks at the master, and between two task lists


class RosDeskLink:
    """Brings what the hive says to the windows, and what a person asks for to the hive.

    Args:
        name: Of the node; ROS adds a number, so that several windows can be open.
        argv: The node's arguments, for remapping.
        shows_map: Whether robots' poses and paths are listened to.

    ROS Subscribers and Publishers:
        Those of `HiveTopics` and `MapTopics`.

    ROS Parameters:
        places, see `place_parameter`; refused_to_start, see `hive_common.ros.refusal`.
    """

    def __init__(self, name: str, argv: list[str], *, shows_map: bool = True) -> None:
        self._name, self._argv = name, argv
        self._inbox = Inbox()
        self._work = Work()
        self._watch = MasterWatch(name)
        self._topics = HiveTopics(self._inbox.put, self._meet)
        self._building: dict[type, PlacesKnown | ZonesKnown] = {}
        self._map = MapTopics(self._inbox.put)
        self._shows_map = shows_map

    def start(self) -> None:
        """Begin to connect, in the background."""
        Thread(target=self._run, name="hive link", daemon=True).start()

    def stop(self) -> None:
        """Disconnect, in the background: the master may not answer."""
        self._work.stop()
        Thread(target=rospy.signal_shutdown, args=("closed",), daemon=True).start()

    def now(self) -> float:
        """Return the hive's time [s]; 0 before it is known."""
        return float(rospy.get_time()) if rospy.rostime.is_rostime_initialized() else 0.0

    def drain(self, limit: int) -> Sequence[Fact]:
        """Return at most `limit` facts that have arrived since the last call, oldest first."""
        return self._inbox.take(limit)

    def send(self, command: Command) -> None:
        """Queue a command; it is sent as soon as the link allows."""
        if isinstance(command, ReadDecisions):
            self._work.put(lambda: self._read_decisions(command.task_id))
        else:
            self._work.put(lambda: self._topics.speak(command))

    def _read_decisions(self, task_id: str) -> None:
        try:
            for decision in read_decisions(journal_folder(), task_id):
                self._inbox.put(DecisionRead(decision))
        except (JournalError, SettingsError) as error:
            rospy.logwarn_throttle_identical(10, str(error))

    def _meet(self, robot: str) -> None:
        self._work.put(lambda: self._topics.advertise_to(robot))
        if self._shows_map:
            self._work.put(lambda: self._map.listen_to_drive(robot))

    def _run(self) -> None:
        """Connect, then run the queued work until stopped."""
        self._report_master(LinkState.SEARCHING)
        while not self._watch.is_up():
            self._work.pause(_TURN)
            if self._work.is_stopped:
                return
        rospy.init_node(self._name, self._argv, anonymous=True, disable_signals=True)
        self._topics.advertise()
        self._topics.listen_to_all()
        self._map.listen_to_person()
        mend_links()
        self._report_master(LinkState.UP)
        troubles = Troubles()
        while not self._work.is_stopped:
            change = self._watch.look()
            if change is not None:
                self._report_master(_LINKS[change])
            if not self._watch.is_lost:
                self._inbox.put(TroublesRead(troubles.read()), TroublesRead)
                self._read_building()
            self._topics.read_list()
            self._work.run_for(_TURN)

    def _read_building(self) -> None:
        """Tell its places and zones; the fleet's launch may set them after this window."""
        if places := hive_places():
            self._tell(PlacesKnown(tuple(Place(name, pose) for name, pose in places.items())))
        if self._shows_map and (zones := _zones()):
            self._tell(ZonesKnown(zones))

    def _tell(self, known: PlacesKnown | ZonesKnown) -> None:
        kind: type = type(known)
        if self._building.get(kind) != known:
            self._building[kind] = known
            self._inbox.put(known, kind)

    def _report_master(self, state: LinkState) -> None:
        self._inbox.put(LinkChange(state, self._watch.address))


def _zones() -> tuple[Zone, ...]:
    """Return the hive's zones; none while the ROS master knows of none, or does not answer."""
    with contextlib.suppress(rospy.ROSException, OSError):
        return zones_of("")
    return ()
