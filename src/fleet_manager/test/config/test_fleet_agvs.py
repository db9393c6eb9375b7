# SPDX-License-Identifier: BSD-3-Clause
"""AGVs that speak VDA 5050 in fleet files, and in the launch files made of them."""

import xml.etree.ElementTree as ET

import pytest
import yaml

from fleet_manager.config.fleet_file import read_fleet
from fleet_manager.config.fleet_launch import launch_text
from hive_common.errors import FileError

AGV = "{name: agv1, model: mir100, pose: [5, 2, 0], driver: vda5050"
ROBOTS = """\
robots:
  - {name: amy, model: mir100, pose: [1, 2, 0]}
  - """


def fleet_of(folder, agv, head=""):
    path = folder / "mine.yaml"
    path.write_text(f"{head}{ROBOTS}{agv}\n", encoding="utf-8")
    return read_fleet(str(path))


def launched(fleet, *, sim=True):
    pytest.importorskip("xacro")
    return ET.fromstring(launch_text(fleet, sim=sim, port=lambda: 4711))  # noqa: S314  (made here)


def parameter(root, node, name):
    return yaml.safe_load(root.find(f"node[@type='{node}']/rosparam[@param='{name}']").text)


def test_a_simulated_agv_gets_an_agent_a_body_and_a_broker_of_its_own(tmp_path):
    root = launched(fleet_of(tmp_path, f"{AGV}, simulated: true}}"))

    assert root.find("node[@type='broker']").get("args") == "4711"
    [agent] = parameter(root, "vda5050_agent", "robots")
    [agv] = parameter(root, "simulated_agv", "agvs")
    same = ("name", "model", "manufacturer", "serial", "version")
    assert [agent[key] for key in same] == [agv[key] for key in same]
    assert agv["pose"] == [5.0, 2.0, 0.0]
    assert agent["simulated"]
    ports = {
        parameter(root, node, "broker")["port"] for node in ("vda5050_agent", "simulated_agv")
    }
    assert ports == {4711}


def test_an_agv_has_the_parameters_of_a_robot_and_no_navigation_of_ours(tmp_path):
    root = launched(fleet_of(tmp_path, f"{AGV}, simulated: true}}"))

    loaded = {each.get("ns") for each in root.findall("rosparam[@file]")}
    assert {"agv1/characteristics", "agv1/robot"} <= loaded
    assert "agv1/move_base" not in loaded
    hosted = yaml.safe_load(root.find("node[@type='robot_host']/rosparam").text)
    assert [each["name"] for each in hosted] == ["amy"]


@pytest.mark.parametrize("sim", [True, False])
def test_a_real_agv_is_found_at_the_broker_that_the_file_names(tmp_path, sim):
    head = "broker: {host: 10.0.0.7, port: 8883}\n"
    own = "vda5050: {manufacturer: Acme, serial: '0017', version: '3.0', interface: plant}"
    root = launched(fleet_of(tmp_path, f"{AGV}, {own}}}", head), sim=sim)

    [agent] = parameter(root, "vda5050_agent", "robots")
    assert agent["manufacturer"] == "Acme"
    assert (agent["serial"], agent["version"], agent["interface"]) == ("0017", "3.0", "plant")
    assert parameter(root, "vda5050_agent", "broker")["host"] == "10.0.0.7"
    assert root.find("node[@type='broker']") is None
    assert root.find("node[@type='simulated_agv']") is None


def test_a_fleet_without_agvs_needs_no_broker():
    root = launched(read_fleet("lab"))

    assert root.find("node[@pkg='vda5050']") is None


@pytest.mark.parametrize(
    ("agv", "words"),
    [
        (AGV.replace("vda5050", "vda") + "}", "allowed: move_base | vda5050"),
        (f"{AGV}, vda5050: {{version: '1.1'}}}}", "allowed: 2.0 | 2.1 | 3.0"),
        (f"{AGV}, vda5050: {{serial: a/b}}}}", "without / + #"),
        (f"{AGV}, simulated: 7}}", "simulated"),
    ],
)
def test_a_mistake_about_an_agv_is_said_with_what_is_allowed(tmp_path, agv, words):
    with pytest.raises(FileError) as caught:
        fleet_of(tmp_path, agv)

    assert words in str(caught.value)


def test_a_real_agv_without_a_model_is_what_its_factsheet_tells(tmp_path):
    root = launched(fleet_of(tmp_path, AGV.replace("model: mir100, ", "") + "}"), sim=False)

    [agent] = parameter(root, "vda5050_agent", "robots")
    assert "model" not in agent
    loaded = {each.get("ns") for each in root.findall("rosparam[@file]")}
    assert "agv1/robot" in loaded
    assert "agv1/characteristics" not in loaded


@pytest.mark.parametrize("driver", ["", ", driver: vda5050, simulated: true"])
def test_other_robots_need_a_model(tmp_path, driver):
    with pytest.raises(FileError, match="model is missing; allowed: the name of a robot model"):
        fleet_of(tmp_path, f"{{name: agv1, pose: [5, 2, 0]{driver}}}")
