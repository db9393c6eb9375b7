# SPDX-License-Identifier: BSD-3-Clause
"""The command line's link to a hive over Zenoh; see `fleet_manager.client.client.ClientLink`."""

from __future__ import annotations

import contextlib
import queue
import time
from typing import TYPE_CHECKING

from blackboard.errors import NoRouterError
from fleet_manager.client.reports import HiveMessage
from fleet_manager.client.topics import STATE
from fleet_manager.desk.facts import CancelTask, PostTask, SetRobotState
from fleet_manager.errors import InputError, NoHiveError
from fleet_manager.zenoh.hive_topics import ZenohTopics, joined

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator, Mapping, Sequence
    from pathlib import Path

    import zenoh

    from blackboard.domain.task import Task
    from fleet_manager.client.traffic import ZoneCommand
    from fleet_manager.config.zenoh_operator import OperatorSite
    from fleet_manager.desk.facts import Fact, Request
    from hive_common.pose import Pose

_LOOK = 0.02  # [s] between two looks


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


class ZenohClientLink:
    """Hands over what the hive says, one report at a time, and posts tasks.

    Args:
        site: How it connects.
        session: Open; the caller closes it.
    """

    def __init__(self, site: OperatorSite, session: zenoh.Session) -> None:
        self._site, self._session = site, session
        self._reports: queue.SimpleQueue[HiveMessage] = queue.SimpleQueue()
        self._topics = ZenohTopics(session, site.settings.own(""), self._put)

    def listen(self, *names: str) -> None:
        """Follow some of the hive's topics from now on; all of its state if none is named."""
        self._topics.listen(names or STATE)

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

    def now(self) -> float:
        """Return a monotonic time [s]."""
        return time.monotonic()

    def hive_time(self, within: float = 0.0) -> float:
        """Return the hive's time [s], that of the leader's last heartbeat; 0 if it is not known.

        It is waited for as long as `within` [s, wall].
        """
        end = self.now() + within
        while not (time_known := self._topics.time) and self.now() < end:
            time.sleep(_LOOK)
        return time_known

    def post(self, task: Task) -> None:
        """Publish a task on `new_task`, once."""
        self._ask(PostTask(task))

    def cancel(self, task_id: str) -> None:
        """Publish a task's id on `task_cancel`, once."""
        self._ask(CancelTask(task_id))

    def switch(self, command: ZoneCommand) -> None:
        """Publish a command on `zone_command`, once."""
        self._ask(command)

    def set_state(self, robot: str, word: str) -> None:
        """Publish a word on a robot's `set_state`, once."""
        self._ask(SetRobotState(robot, word))

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

    def receive(self, timeout: float) -> HiveMessage | None:
        """Return the next report, or None after `timeout` [s]."""
        with contextlib.suppress(queue.Empty):
            return self._reports.get(timeout=max(timeout, 0.0))
        return None

    def _ask(self, request: Request) -> None:
        """Publish a request; raise InputError if this program may not ask for anything."""
        if self._site.why_silent:
            raise InputError(self._site.why_silent)
        self._topics.speak(request)

    def _put(self, fact: Fact, _supersedes: Hashable = None) -> None:
        if isinstance(fact, HiveMessage):
            self._reports.put(fact)
