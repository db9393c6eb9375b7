# SPDX-License-Identifier: BSD-3-Clause
"""Where robots are and where they drive, as their machines tell it to others for display."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import genpy
from zenoh.handlers import Callback

from blackboard.board.refusals import Refusals
from blackboard.codec.drive_kinds import KINDS, PLAN, POSE
from blackboard.zenoh.access import PART, key_of
from blackboard.zenoh.link import deserialized
from fleet_manager.codec.drive_facts import path_fact, pose_fact

if TYPE_CHECKING:
    from collections.abc import Callable

    import zenoh

    from blackboard.zenoh.session import Own
    from fleet_manager.desk.inbox import FactSink

_FACTS: dict[str, Callable[[str, Any], Any]] = {POSE: pose_fact, PLAN: path_fact}


class Drives:
    """Listens to the poses and paths of robots.

    Args:
        session: Open; the caller closes it.
        own: The hive, and as whom this program speaks.
        put: Takes in facts.
        warn: Tells a person what was refused.
    """

    def __init__(
        self, session: zenoh.Session, own: Own, put: FactSink, warn: Callable[[str], None]
    ) -> None:
        self._session, self._hive, self._put = session, own.hive, put
        self._refusals = Refusals(warn)

    def follow(self, robot: str) -> None:
        """Follow a robot's pose and its planned path; names that no key can have are left out."""
        if not PART.fullmatch(robot):
            return
        for topic in KINDS:
            hear = Callback(partial(self._hear, robot, topic), indirect=False)
            self._session.declare_subscriber(key_of(self._hive, f"{robot}/{topic}", robot), hear)

    def _hear(self, robot: str, topic: str, sample: zenoh.Sample) -> None:
        try:
            msg = deserialized(KINDS[topic], sample.payload)
            self._put(_FACTS[topic](robot, msg), (topic, robot))
        except (ValueError, genpy.DeserializationError) as error:
            self._refusals.refuse(f"{robot}/{topic}", str(error))
