# SPDX-License-Identifier: BSD-3-Clause
"""The command line's link to a hive over Zenoh; see `fleet_manager.client.client.ClientLink`."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from blackboard.errors import NoRouterError
from fleet_manager.desk.topic_link import TopicLink
from fleet_manager.errors import InputError, NoHiveError
from fleet_manager.zenoh.hive_topics import ZenohTopics, joined

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    import zenoh

    from fleet_manager.config.zenoh_operator import OperatorSite
    from fleet_manager.desk.facts import Request
    from hive_common.pose import Pose


@contextlib.contextmanager
def connect(site: OperatorSite, record: Sequence[str] = ()) -> Iterator[ZenohClientLink]:
    """Open a link to a hive over Zenoh; close it at the end.

    Raises:
        InputError: Robots are to be recorded, which only their simulator's ROS master tells of.
        NoHiveError: None of the hive's routers answers.
        blackboard.errors.SettingsError: An endpoint or the certificate cannot be used.
    """
    if record:
        raise InputError("robots are recorded on the machine that simulates them; omit --connect")
    with contextlib.ExitStack() as stack:
        try:
            session = stack.enter_context(joined(site))
        except NoRouterError as error:
            raise NoHiveError(str(error)) from None
        yield ZenohClientLink(site, session)


class ZenohClientLink(TopicLink):
    """Hands over what the hive says, one report at a time, and publishes requests.

    Args:
        site: How it connects.
        session: Open; the caller closes it.
    """

    def __init__(self, site: OperatorSite, session: zenoh.Session) -> None:
        super().__init__()
        self._site, self._session = site, session
        self._topics: ZenohTopics = ZenohTopics(session, site.settings.own(""), self._put)

    def _known_time(self) -> float:
        """Return the time of the leader's last heartbeat [s]."""
        return self._topics.time

    def has_heard_robots(self) -> bool:
        """Return whether all robots that the leader hears have told their status.

        `receive` has given out what they told then.
        """
        beat = self._topics.beat
        is_all = beat is not None and beat.heard.keys() <= self._topics.heard
        return is_all and self._reports.empty()

    def troubles(self) -> Sequence[str]:
        """Return why no leader is heard, if so; what members say is wrong does not cross."""
        if self._topics.beat is not None:
            return ()
        if self._session.info.links():
            return ("no leader is heard there; without a fleet file, --connect has to name all",)
        trouble = (
            f"nothing is connected at {self._site.address}; check that it runs and is reached "
            "from here, and that its access list has your certificate"
        )
        return (trouble,)

    def places(self) -> Mapping[str, Pose]:
        """Return the named places of the hive's building [map frame]."""
        return self._site.places

    def radius_of(self, _robot: str) -> float | None:
        """Return that this is not known: it is a parameter on the robot's machine."""
        return None

    def learned_of(self, robot: str) -> object:
        """Raise NoHiveError: what a robot has learned is a parameter on its machine."""
        raise NoHiveError(f"what {robot} has learned is known on its machine; ask there")

    def change_map(self, path: Path) -> None:
        """Raise NoHiveError: each machine has a map server of its own."""
        raise NoHiveError(f"each machine has a map server of its own; load {path.name} there")

    def _ask(self, request: Request) -> None:
        """Publish a request; raise InputError if this program may not ask for anything."""
        if self._site.why_silent:
            raise InputError(self._site.why_silent)
        super()._ask(request)
