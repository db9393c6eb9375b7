# SPDX-License-Identifier: BSD-3-Clause
"""An AGV without a model file, until its factsheet has told what it is."""

from __future__ import annotations

import itertools
import time
from typing import TYPE_CHECKING, Any

import rospy

from hive_common.structuring import NotAllowedError, structure
from robot_description.models import RobotModel
from vda5050.agent.body import model_of
from vda5050.agent.inspection import Inspector
from vda5050.protocol.actions import FACTSHEET_REQUEST, Action, BlockingType, InstantActions
from vda5050.protocol.codec import encode
from vda5050.protocol.factsheet import Factsheet
from vda5050.protocol.header import Header, timestamp_of
from vda5050.protocol.topics import Address, Topic
from vda5050.protocol.versions import Version

if TYPE_CHECKING:
    from hive_common.ros.names import RobotNames
    from vda5050.mqtt.link import Link
    from vda5050.ros.vehicle_settings import AgentEntry

ASK_PERIOD = 5.0
"""Between two requests for the factsheet [s]."""


class Newcomer:
    """One AGV that is waited for.

    Args:
        names: Of the robot.
        entry: What is known of it.
        link: To the broker.
    """

    def __init__(self, names: RobotNames, entry: AgentEntry, link: Link) -> None:
        self.names, self.entry = names, entry
        self._version, self._link = Version(entry.version), link
        self.address = Address.of(self._version, entry.manufacturer, entry.serial, entry.interface)
        self._inspector = Inspector(
            self.address, self._version, time.time, lambda *_: True, rospy.logwarn
        )
        self._numbers = itertools.count()
        link.subscribe([self.address.topic(Topic.FACTSHEET)])

    def ask(self) -> None:
        """Ask for the factsheet; the AGV may have told it before anybody listened."""
        number = next(self._numbers)
        wanted = Action(FACTSHEET_REQUEST, f"{self.names.robot}-{number}", BlockingType.NONE)
        address = self.address
        header = Header(
            number,
            timestamp_of(time.time()),
            self._version.text,
            address.manufacturer,
            address.serial,
        )
        payload = encode(header, InstantActions((wanted,)), self._version)
        self._link.publish(address.topic(Topic.INSTANT_ACTIONS), payload)

    def read(self, payload: bytes) -> dict[str, Any] | None:
        """Return the content of a robot model once a factsheet has told it.

        What the parameter `characteristics` of the robot holds already goes before that.
        """
        body = self._inspector.read(Topic.FACTSHEET, payload)
        if not isinstance(body, Factsheet):
            return None
        content = model_of(body, rospy.get_param(self.names.of("characteristics"), {}))
        try:
            structure(content, RobotModel)
        except NotAllowedError as error:
            rospy.logwarn(
                f"{self.names.robot}: its factsheet makes no robot model: {error}; "
                "give it a model file in the fleet file"
            )
            return None
        return content
