# SPDX-License-Identifier: BSD-3-Clause
"""The windows' link to a hive over Zenoh; see `fleet_manager.desk.facts.DeskLink`.

Whatever may wait (a router, the map's file, the hive) waits in the link's own thread and never in
the windows' event loop.
"""

from __future__ import annotations

import logging
from functools import partial
from threading import Thread
from typing import TYPE_CHECKING

from blackboard.errors import NoRouterError
from fleet_manager.desk.chart import levels_of
from fleet_manager.desk.facts import (
    LinkChange,
    LinkState,
    MapKnown,
    PlacesKnown,
    ReadDecisions,
    TroublesRead,
    ZonesKnown,
)
from fleet_manager.desk.inbox import Inbox
from fleet_manager.desk.places import Place
from fleet_manager.desk.work import Work
from fleet_manager.zenoh.drives import Drives
from fleet_manager.zenoh.hive_topics import ZenohTopics, joined
from hive_common.errors import HiveError
from hive_common.map_file import load_map

if TYPE_CHECKING:
    from collections.abc import Sequence

    import zenoh

    from fleet_manager.config.zenoh_operator import OperatorSite
    from fleet_manager.desk.facts import Command, Fact, Request

_TURN = 0.5  # [s] between two looks at the connections, and between two task lists

_HIVE = "hive"

log = logging.getLogger("rosout")


class ZenohDeskLink:
    """Brings what the hive says to the windows, and what a person asks for to the hive.

    Args:
        site: How it connects.
        chart: The map that is shown, by its name in `maps/` or by its path; empty for none.
        shows_map: Whether robots' poses and paths are listened to.
    """

    def __init__(self, site: OperatorSite, chart: str = "", *, shows_map: bool = True) -> None:
        self._site, self._chart, self._shows_map = site, chart, shows_map
        self._inbox = Inbox()
        self._work = Work()
        # No daemon: while Python ends, a session can no longer be closed.
        self._thread = Thread(target=self._run, name="hive link")
        self._topics: ZenohTopics | None = None
        self._link_state: LinkState | None = None
        self._troubles: list[str] = []

    def start(self) -> None:
        """Begin to connect, in the background."""
        self._thread.start()

    def stop(self) -> None:
        """Disconnect, in the background."""
        self._work.stop()

    def now(self) -> float:
        """Return the hive's time [s]; 0 before it is known."""
        return self._topics.time if self._topics is not None else 0.0

    def drain(self, limit: int) -> Sequence[Fact]:
        """Return at most `limit` facts that have arrived since the last call, oldest first."""
        return self._inbox.take(limit)

    def send(self, command: Command) -> None:
        """Queue a command; it is sent as soon as the link allows.

        Recorded auctions are files on the machines of members, so there are none to read.
        """
        if not isinstance(command, ReadDecisions):
            self._work.put(lambda: self._speak(command))

    def _speak(self, request: Request) -> None:
        if self._topics is not None:
            self._topics.speak(request)

    def _run(self) -> None:
        """Connect, then run the queued work until stopped."""
        self._tell_state(LinkState.SEARCHING)
        self._tell_building()
        while not self._work.is_stopped:
            try:
                with joined(self._site) as session:
                    self._follow(session)
            except NoRouterError:
                self._work.pause(_TURN)
            except HiveError as error:
                self._tell_trouble(str(error))
                return

    def _tell_building(self) -> None:
        """Tell what the files say of the building."""
        places = tuple(Place(name, pose) for name, pose in self._site.places.items())
        self._inbox.put(PlacesKnown(places), PlacesKnown)
        self._inbox.put(ZonesKnown(self._site.zones), ZonesKnown)
        if self._chart:
            try:
                self._inbox.put(MapKnown(levels_of(load_map(self._chart))), MapKnown)
            except HiveError as error:
                self._tell_trouble(str(error))

    def _follow(self, session: zenoh.Session) -> None:
        own = self._site.settings.own("")
        drives = Drives(session, own, self._inbox.put, log.warning)
        met = partial(self._meet, drives) if self._shows_map else lambda _robot: None
        topics = self._topics = ZenohTopics(session, own, self._inbox.put, met, log.warning)
        topics.listen_to_all()
        if self._site.why_silent:
            self._tell_trouble(self._site.why_silent)
        while not self._work.is_stopped:
            links = session.info.links()
            if links or self._link_state is LinkState.UP:
                self._tell_state(LinkState.UP if links else LinkState.LOST)
            topics.read_list()
            self._work.run_for(_TURN)

    def _meet(self, drives: Drives, robot: str) -> None:
        self._work.put(lambda: drives.follow(robot))

    def _tell_trouble(self, text: str) -> None:
        self._troubles.append(text)
        self._inbox.put(TroublesRead(tuple(self._troubles)), TroublesRead)

    def _tell_state(self, state: LinkState) -> None:
        if state is not self._link_state:
            self._link_state = state
            self._inbox.put(LinkChange(state, self._site.address, _HIVE))
