# SPDX-License-Identifier: BSD-3-Clause
"""Odd values on the parameter server are refused in one line by whatever reads them."""

from __future__ import annotations

import copy
from random import Random
from typing import Any

import pytest

pytest.importorskip("blackboard.msg", reason="needs generated messages: ./hive test hive")

import rosgraph
import rospy
import yaml

from blackboard.domain.characteristics import characteristics_from
from blackboard.domain.settings import (
    BlackboardSettings,
    PathSettings,
    RaftSettings,
    TrafficSettings,
)
from blackboard.ros.membership import journal_folder
from blackboard.ros.robot_node import charging_plan, read_robot_settings
from blackboard.ros.traffic_told import zones_of
from fleet_manager.ros.robot_host_node import HostedRobot
from hive_common.errors import HiveError
from hive_common.resources import package_folder
from hive_common.ros import params
from hive_common.ros.names import RobotNames
from hive_lab.fuzz.odd_files import change
from hive_navigation.control.goal_tracker import NavigationSettings
from hive_navigation.localization.amcl_settings import AmclSettings
from hive_navigation.mapping.mapper_settings import MapperSettings
from hive_navigation.ros.fake_localization_node import FakeLocalizationSettings
from hive_navigation.ros.startup import read_model, read_settings
from hive_navigation.ros.traffic_parameters import TrafficParameters
from robot_description.ros.fixed_links import links_of
from robot_description.urdf import robot_urdf
from vda5050.mqtt.link import BrokerSettings
from vda5050.ros.vehicle_settings import AgentEntry, ConnectorEntry

CHANGES = 400
ROBOT = RobotNames("/", "robot1")


def file(package: str, path: str) -> Any:
    """Return a YAML file of a package."""
    return yaml.safe_load((package_folder(package) / path).read_text(encoding="utf-8"))


def parameters() -> dict[str, Any]:
    """Return the parameters of a hive as its launch files set them."""
    move_base, amcl, mapper = (
        file("hive_navigation", f"config/{name}.yaml") for name in ("move_base", "amcl", "mapper")
    )
    agv = {"name": "agv1", "manufacturer": "Acme", "serial": "0017"}
    area = [[1.0, 1.0], [3.0, 1.0], [3.0, 3.0]]
    return {
        "journal": "journals",
        "fleet": {"cost_model": "time", "distance": "path"},
        "charging": {"low": 0.3, "chargers": [{"name": "dock", "pose": [1.0, 2.0, 0.0]}]},
        "blackboard": file("blackboard", "config/blackboard.yaml"),
        "robot1": {
            "characteristics": file("robot_description", "models/fetch.yaml"),
            "robot_description": robot_urdf("fetch", "robot1/"),
            "robot": file("blackboard", "config/robot.yaml"),
            "move_base": move_base,
            "amcl": amcl,
            "mapper": mapper,
            "fake_localization": {"transform_tolerance": 0.2},
        },
        "node": {
            "epoch": 3,
            "zones": [{"name": "aisle", "kind": "slow", "speed": 0.5, "corners": area}],
            "closed": ["aisle"],
            "places": [{"name": "dock", "at": [1.0, 2.0]}],
            "robots": [
                {
                    "name": "robot1",
                    "model": "fetch",
                    "pose": [1.0, 2.0, 0.0],
                    "localization": "amcl",
                    "navigation": "ours",
                }
            ],
            "agvs": [agv],
            "connector": {"manufacturer": "Acme", "serial": "0017"},
            "broker": {"host": "localhost", "port": 1883},
        },
        "traffic_planner": {"zones": []},
    }


def read_all() -> None:
    """Read every parameter as nodes do at their start."""
    characteristics_from(rospy.get_param("/robot1/characteristics", {}))
    params.number("charge", least=0.0, most=1.0, default=1.0, node="/robot1/robot")
    read_robot_settings(ROBOT)
    charging_plan("/")
    journal_folder("/robot1/robot")
    for kind in (RaftSettings, BlackboardSettings, TrafficSettings, PathSettings):
        params.read(kind, "/blackboard")
    zones_of("/")
    TrafficParameters.read()
    read_model(ROBOT)
    read_settings(NavigationSettings, "/robot1/move_base")
    amcl = read_settings(AmclSettings, "/robot1/amcl")
    read_settings(MapperSettings, "/robot1/mapper")
    read_settings(FakeLocalizationSettings, "/robot1/fake_localization")
    links_of(ROBOT)
    assert not amcl.initial_pose.flaw
    params.structured("~robots", tuple[HostedRobot, ...], [])
    params.structured("~agvs", tuple[AgentEntry, ...], [])
    params.structured("~connector", ConnectorEntry, {})
    params.structured("~broker", BrokerSettings, {})


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """The parameters of a hive, and of the node /node."""
    known = parameters()

    def get_param(name: str, default: Any = None) -> Any:
        found: Any = known
        for key in rospy.resolve_name(name).strip("/").split("/"):
            if not isinstance(found, dict) or key not in found:
                return default
            found = found[key]
        return found

    class Master:
        def __init__(self, _caller: str) -> None: ...

        def searchParam(self, name: str) -> str:  # noqa: N802  (rosgraph's name)
            if name not in known:
                raise rosgraph.MasterError("not set")
            return f"/{name}"

        def getParam(self, name: str) -> Any:  # noqa: N802  (rosgraph's name)
            return get_param(name)

    monkeypatch.setattr(rosgraph, "Master", Master)
    monkeypatch.setattr(rospy, "get_param", get_param)
    monkeypatch.setattr(rospy, "get_name", lambda: "/node")
    monkeypatch.setattr(rospy, "resolve_name", lambda name: name.replace("~", "/node/"))
    monkeypatch.setattr(rospy.Time, "now", lambda: rospy.Time(1))
    return known


def test_the_parameters_as_launch_files_set_them_are_read(server: dict[str, Any]) -> None:
    assert server["node"]["epoch"] == 3
    read_all()


@pytest.mark.parametrize("seed", range(4))
def test_odd_parameters_are_refused_in_words_or_work(server: dict[str, Any], seed: int) -> None:
    random, good = Random(seed), copy.deepcopy(server)
    refused = taken = 0
    for _ in range(CHANGES):
        server.clear()
        server.update(copy.deepcopy(good))
        what = change(server, random)
        try:
            read_all()
        except HiveError:
            refused += 1
        except Exception as error:
            raise AssertionError(f"{what}: {error!r}") from error
        else:
            taken += 1

    assert refused > CHANGES / 4
    assert taken > CHANGES / 20
