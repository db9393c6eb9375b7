# SPDX-License-Identifier: BSD-3-Clause
"""The node `vda5050_connector`: one `move_base` robot for any VDA 5050 master."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import rospy
from sensor_msgs.msg import BatteryState

from blackboard.ros.startup import run_node
from hive_common.errors import ParameterError
from hive_common.ros.inbox import Inbox
from hive_common.ros.names import own_names
from hive_common.ros.params import below, structured
from hive_common.structuring import NotAllowedError, structure
from hive_navigation.ros.startup import read_model
from vda5050.connector.connector import Connector, ConnectorSettings
from vda5050.mqtt.link import BrokerSettings
from vda5050.protocol.topics import Address
from vda5050.protocol.versions import Version
from vda5050.ros.robot_actions import RosArm, RosNavigation
from vda5050.ros.vehicle_link import VehicleLink, keep_stepping
from vda5050.ros.vehicle_settings import ConnectorEntry
from vda5050.vehicle.channel import Channel

if TYPE_CHECKING:
    from hive_common.ros.names import RobotNames


def main() -> None:
    """Run the connector of the robot in whose namespace the node is, until it is shut down.

    ROS Subscribers: those of `RosNavigation`; `battery_state` (sensor_msgs/BatteryState).
    ROS Publishers, ROS Actions: those of `RosNavigation` and `RosArm`.
    ROS Parameters: the fields of `ConnectorEntry`; `~broker`, see `BrokerSettings`;
        `characteristics` of the robot.
    """
    run_node("vda5050_connector", _run)


def _run() -> None:
    names = own_names()
    given = dict(below(rospy.get_name()))
    broker = structured("~broker", BrokerSettings, {})
    given.pop("broker", None)
    try:
        entry = structure(given, ConnectorEntry)
    except NotAllowedError as error:
        raise ParameterError(f"{rospy.get_name()}/{error}") from None
    version = Version(entry.version)
    address = Address.of(version, entry.manufacturer, entry.serial, entry.interface)
    inbox = Inbox()
    link = VehicleLink(broker, address, inbox)
    model = read_model(names)
    navigation = RosNavigation(names, inbox)
    arm = RosArm(names, inbox) if model.arm is not None else None
    connector = Connector(
        ConnectorSettings(version=version, map_id=entry.map_id, rates=entry.rates),
        model,
        navigation,
        arm,
        Channel(address, version, link.send, time.time),
    )
    _hear_battery(names, connector, inbox)

    def step(now: float) -> None:
        navigation.step()
        if arm is not None:
            arm.step()
        connector.step(now)

    link.start(connector.endpoint, connector.hear)
    try:
        keep_stepping([step], inbox)
    finally:
        link.stop()


def _hear_battery(names: RobotNames, connector: Connector, inbox: Inbox) -> None:
    def take(message: BatteryState) -> None:
        if math.isfinite(message.percentage):
            connector.tools.charge = 100.0 * min(max(message.percentage, 0.0), 1.0)
        charging = BatteryState.POWER_SUPPLY_STATUS_CHARGING
        connector.tools.is_charging = message.power_supply_status == charging

    topic = names.of("battery_state")
    rospy.Subscriber(topic, BatteryState, lambda message: inbox.put(lambda: take(message)))
