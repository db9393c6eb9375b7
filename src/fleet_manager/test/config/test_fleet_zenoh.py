# SPDX-License-Identifier: BSD-3-Clause
"""Fleets whose members speak over Zenoh, and the launch files made of them."""

import re
import shlex
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import yaml

from blackboard.zenoh.settings import ZenohSettings
from fleet_manager.config.fleet_file import (
    read_fleet,
    read_fleet_and_mistakes,
)
from fleet_manager.config.fleet_launch import launch_text
from fleet_manager.config.zenoh_launch import connection_of, unknown_on
from hive_common.structuring import structure

PAGE = Path(__file__).parents[4] / "docs" / "many-machines.md"
ROBOTS = """\
robots:
  - {name: amy, model: mir100, pose: [1, 2, 0]}
  - {name: bob, model: mir100, pose: [5, 2, 0]}
"""
MEMBERS = """\
transport: zenoh
zenoh:
  certificates: certs
  operators: [anna, eve]
  members:
    - {name: blackboard, address: "10.0.0.1:7447"}
    - {name: amy, address: "10.0.0.2:7447"}
    - {name: bob, address: "10.0.0.3:7447"}
"""
MASTERS = "traffic: planned\nbid_timeout: 3\n"


@pytest.fixture
def file(tmp_path):
    return tmp_path / "mine.yaml"


def fleet_of(file, head=MEMBERS, robots=ROBOTS):
    file.write_text(f"{head}{robots}", encoding="utf-8")
    return read_fleet(str(file))


def mistakes_in(file, text):
    file.write_text(text, encoding="utf-8")
    return [str(each) for each in read_fleet_and_mistakes(str(file))[1]]


def launched(fleet, *machine, sim=False):
    text = launch_text(fleet, sim=sim, machine=machine)
    return ET.fromstring(text)  # noqa: S314  (made here)


def settings(root):
    """Return what the parameter `zenoh` of each node says."""
    found = {
        each.get("param").removesuffix("/zenoh"): yaml.safe_load(each.text)
        for each in root.iterfind("rosparam")
        if each.get("param", "").endswith("/zenoh")
    }
    gateway = root.find("node[@type='hive_gateway']/rosparam")
    if gateway is not None:
        found["hive_gateway"] = yaml.safe_load(gateway.text)
    return found


def robots_in(root):
    files = [
        each for each in root.iterfind("include") if each.get("file").endswith("robot.launch")
    ]
    return [each.find("arg[@name='name']").get("value") for each in files]


def test_each_member_listens_where_the_fleet_says_and_connects_to_those_before_it(file):
    fleet = fleet_of(file)

    told = {name: settings(launched(fleet, name)) for name in ("blackboard", "amy", "bob")}

    folder = file.parent / "certs"
    assert told["blackboard"] == {
        "blackboard": {
            "listen": ["tls/10.0.0.1:7447"],
            "own_master": True,
            "certificates": str(folder / "blackboard"),
        }
    }
    assert told["bob"] == {
        "bob/robot": {
            "listen": ["tls/10.0.0.3:7447"],
            "connect": ["tls/10.0.0.1:7447", "tls/10.0.0.2:7447"],
            "own_master": True,
            "certificates": str(folder / "bob"),
        }
    }
    for node in told.values():
        for each in node.values():
            structure(each, ZenohSettings)  # names what is not allowed


def test_a_machine_starts_its_own_member_alone(file):
    fleet = fleet_of(file)

    assert robots_in(launched(fleet, "amy")) == ["amy"]
    assert robots_in(launched(fleet, "blackboard")) == []
    assert robots_in(launched(fleet, "blackboard", "bob", "anna")) == ["bob"]


def test_a_machine_simulates_its_own_robot_alone(file):
    root = launched(fleet_of(file), "amy", sim=True)

    (robot,) = root.iterfind("include")
    told = {each.get("name"): each.get("value") for each in robot.iterfind("arg")}
    assert (told["name"], told["sim"]) == ("amy", "true")


def test_an_operator_s_machine_has_a_gateway_to_all_members(file):
    told = settings(launched(fleet_of(file), "eve"))

    assert told == {
        "hive_gateway": {
            "connect": [f"tls/10.0.0.{number}:7447" for number in (1, 2, 3)],
            "own_master": True,
            "certificates": str(file.parent / "certs" / "eve"),
        }
    }


def test_an_operator_s_machine_can_draw_the_robots_of_other_machines(file):
    def drawn(*machine):
        root = launched(fleet_of(file), *machine)
        names = [each.get("name") for each in root.iterfind("param")]
        end = "/robot_description"
        return {name.removesuffix(end) for name in names if name.endswith(end)}

    assert drawn("eve") == {"amy", "bob"}
    assert drawn("amy", "eve") == {"bob"}  # amy's own launch file loads hers
    assert drawn("amy") == drawn("blackboard") == set()


ROUTERS = """\
transport: zenoh
zenoh:
  certificates: certs
  operators: [anna, eve]
  routers:
    - {name: north, address: "10.0.0.1:7447", serves: [blackboard, eve]}
    - {name: south, address: "10.1.0.1:7447", listen: "192.168.7.1:7447", serves: [bob]}
"""


def test_with_routers_members_and_operators_connect_to_their_own_and_then_to_the_others(file):
    fleet = fleet_of(file, ROUTERS)
    north, south = "tls/10.0.0.1:7447", "tls/10.1.0.1:7447"

    def told(name):
        ((node, said),) = settings(launched(fleet, name)).items()
        structure(said, ZenohSettings)  # names what is not allowed
        assert Path(said["certificates"]).name == name
        return node, said["mode"], said["connect"], "listen" in said

    assert told("blackboard") == ("blackboard", "client", [north, south], False)
    assert told("amy") == ("amy/robot", "client", [north, south], False)
    assert told("bob") == ("bob/robot", "client", [south, north], False)
    assert told("eve") == ("hive_gateway", "client", [north, south], False)
    assert told("anna") == ("hive_gateway", "client", [north, south], False)


def routers_in(root):
    found = root.iterfind("node[@type='hive']")
    return {each.get("name"): each.get("args") for each in found}


def test_a_router_s_machine_runs_it_and_no_member(file):
    fleet = fleet_of(file, ROUTERS)

    root = launched(fleet, "south")
    assert routers_in(root) == {"router_south": f"router south --fleet {file}"}
    assert root.find("node[@type='hive']").get("respawn") == "true"
    assert settings(root) == {}
    assert routers_in(launched(fleet, "bob")) == {}
    assert set(routers_in(launched(fleet))) == {"router_north", "router_south"}


def test_a_fleet_file_may_lie_in_a_folder_with_a_space_in_its_name(tmp_path):
    folder = tmp_path / "hall's map"
    folder.mkdir()
    root = launched(fleet_of(folder / "my fleet.yaml", ROUTERS), "south")

    words = shlex.split(routers_in(root)["router_south"])
    assert words == ["router", "south", "--fleet", str(folder / "my fleet.yaml")]


def test_of_two_routers_the_later_one_connects_to_the_other(file):
    fleet = fleet_of(file, ROUTERS)

    certs = file.parent / "certs"
    assert connection_of(fleet, "north") == {
        "listen": ["tls/10.0.0.1:7447"],
        "certificates": str(certs / "north"),
    }
    assert connection_of(fleet, "south") == {
        "listen": ["tls/192.168.7.1:7447"],
        "connect": ["tls/10.0.0.1:7447"],
        "certificates": str(certs / "south"),
    }


def test_every_machine_knows_the_hive_s_settings(file):
    root = launched(fleet_of(file, MEMBERS + MASTERS), "amy")

    given = yaml.safe_load(root.find("rosparam[@param='blackboard']").text)
    assert (given["traffic"], given["bid_timeout"]) == ("planned", 3.0)
    assert root.find("rosparam[@ns='blackboard']").get("file").endswith("/blackboard.yaml")


def test_on_one_machine_members_are_reached_at_ports_of_their_own_that_others_do_not_reach(file):
    root = launched(fleet_of(file, "transport: zenoh\n"))

    told = settings(root)
    ends = [f"tcp/127.0.0.1:{port}" for port in (7447, 7448, 7449)]
    assert told == {
        "blackboard": {"listen": ends[:1], "own_master": False},
        "amy/robot": {"listen": ends[1:2], "connect": ends[:1], "own_master": False},
        "bob/robot": {"listen": ends[2:], "connect": ends[:2], "own_master": False},
        "hive_gateway": {"connect": ends, "own_master": False},
    }
    assert robots_in(root) == ["amy", "bob"]


def test_simulated_robots_have_processes_of_their_own(file):
    pytest.importorskip("xacro")
    text = launch_text(fleet_of(file, "transport: zenoh\n"), sim=True)

    assert "robot_host" not in text


def test_simulated_robots_share_processes_over_zenoh_too_if_the_fleet_says_so(file):
    pytest.importorskip("xacro")
    fleet = fleet_of(file, "transport: zenoh\nprocesses: shared\n")
    root = launched(fleet, sim=True)

    assert [each.get("name") for each in root.iter("node")][:1] == ["robot_host_1"]
    assert {"amy/robot", "bob/robot"} <= settings(root).keys()
    assert robots_in(root) == []
    assert "robot_host" not in launch_text(fleet, sim=False)
    assert "robot_host" not in launch_text(fleet, sim=True, machine=["amy"])


AGVS = """\
  - {name: agv1, pose: [20, 2, 0], driver: vda5050}
  - {name: agv2, pose: [22, 2, 0], driver: vda5050}
broker: {host: 10.0.0.9}
"""


def test_a_machine_has_any_number_of_agvs_besides_one_robot(file):
    fleet = fleet_of(file, ROUTERS, ROBOTS + AGVS)
    root = launched(fleet, "amy", "agv2")
    told = settings(root)

    assert unknown_on(fleet, ["amy", "agv1", "agv2"]) == ""
    assert unknown_on(fleet, ["amy", "bob", "agv1"]).endswith("AGVs with driver: vda5050")
    assert told.keys() == {"amy/robot", "agv2/robot"}
    assert told["agv2/robot"] == {
        "mode": "client",
        "connect": ["tls/10.0.0.1:7447", "tls/10.1.0.1:7447"],
        "certificates": str(file.parent / "certs" / "agv2"),
        "own_master": True,
    }
    assert robots_in(root) == ["amy"]
    (agent,) = (each for each in root.iter("node") if each.get("type") == "vda5050_agent")
    (known,) = (each for each in agent.iterfind("rosparam") if each.get("param") == "robots")
    assert [each["name"] for each in yaml.safe_load(known.text)] == ["agv2"]


def test_a_machine_without_agvs_has_no_agent(file):
    fleet = fleet_of(file, ROUTERS, ROBOTS + AGVS)

    assert "vda5050" not in launch_text(fleet, sim=True, machine=["amy"])


def test_over_ros_nothing_speaks_over_zenoh(file):
    root = launched(fleet_of(file, ""))

    assert settings(root) == {}


@pytest.mark.parametrize(
    ("head", "machine", "words"),
    [
        ("", ["amy"], "with transport: ros all machines share one ROS master"),
        (MEMBERS, ["amy", "carl"], "carl; allowed: blackboard, amy, bob, anna, eve"),
        (MEMBERS, ["amy", "bob"], "amy, bob; allowed: one robot, because"),
        ("transport: zenoh\n", ["amy"], "does not say where members are reached"),
        (ROUTERS, ["hall"], "hall; allowed: blackboard, amy, bob, anna, eve, north, south"),
    ],
)
def test_what_a_machine_cannot_run_is_named_with_what_it_can(file, head, machine, words):
    assert words in unknown_on(fleet_of(file, head), machine)


@pytest.mark.parametrize("machine", [[], ["amy"], ["blackboard", "anna"]])
def test_what_a_machine_can_run_is_not_refused(file, machine):
    assert unknown_on(fleet_of(file), machine) == ""
    assert unknown_on(fleet_of(file, ROUTERS), [*machine, "south"]) == ""


@pytest.mark.parametrize(
    ("head", "change", "words"),
    [
        (
            MEMBERS,
            ("name: bob, a", "name: carl, a"),
            "'carl' is no member; allowed: blackboard, amy, bob",
        ),
        (MEMBERS, ("name: bob, a", "name: amy, a"), "'amy' is there twice"),
        (MEMBERS, ('    - {name: bob, address: "10.0.0.3:7447"}\n', ""), "bob missing"),
        (MEMBERS, ("10.0.0.3:7447", "10.0.0.3"), "allowed: HOST:PORT"),
        (MEMBERS, ("10.0.0.3:7447", "10.0.0.3:74470"), "allowed: HOST:PORT"),
        (
            MEMBERS,
            ("  certificates: certs\n", ""),
            "'10.0.0.2:7447' is reached from other machines",
        ),
        (MEMBERS, ("eve", "bob"), "'bob' is a member; an operator needs a name"),
        (ROUTERS, ("name: south", "name: north"), "'north' is the name of another one"),
        (ROUTERS, ("name: south", "name: eve"), "'eve' is the name of another one"),
        (ROUTERS, ("name: south", "name: so-uth"), "allowed: a name for ROS: a letter"),
        (
            ROUTERS,
            ("[bob]", "[bob, carl]"),
            "'carl' is unknown; allowed: blackboard, amy, bob, anna, eve",
        ),
        (ROUTERS, ("[bob]", "[eve]"), "'eve' is served by north already"),
        (ROUTERS, ("10.1.0.1:7447", "10.1.0.1"), "allowed: HOST:PORT"),
        (
            ROUTERS,
            ("  certificates: certs\n", ""),
            "'192.168.7.1:7447' is reached",
        ),
        (
            ROUTERS,
            ("  routers:", '  members: [{name: amy, address: "10.0.0.5:1"}]\n  routers:'),
            "not allowed together with `routers`",
        ),
    ],
)
def test_a_mistake_in_how_members_reach_each_other_is_named_in_its_line(file, head, change, words):
    found = mistakes_in(file, head.replace(*change) + ROBOTS)

    assert any(words in each and "mine.yaml:" in each for each in found), found


def test_the_fleets_of_the_page_are_good_and_its_machines_are_theirs(file):
    page = PAGE.read_text(encoding="utf-8")
    blocks = re.findall(r"^ {3}```yaml\n(.*?)^ {3}```", page, re.DOTALL | re.MULTILINE)
    direct, routed = (re.sub("^ {3}", "", each, flags=re.MULTILINE) for each in blocks)
    robots = "".join(
        f"  - {{name: robot{number}, model: mir100, pose: [{2 * number}, 2, 0]}}\n"
        for number in range(1, 5)
    )
    robots += AGVS.replace("broker", "# broker")

    assert mistakes_in(file, direct) == []
    peers = read_fleet(str(file))
    assert mistakes_in(file, f"transport: zenoh\n{routed}robots:\n{robots}") == []
    routers = read_fleet(str(file))
    machines = [each.strip('"') for each in re.findall(r'machine:=("[^"]+"|\w+)', page)]
    assert {"blackboard laptop1", "hall_a"} <= set(machines)
    for each in machines:
        assert "" in {unknown_on(fleet, each.split()) for fleet in (peers, routers)}, each
