# SPDX-License-Identifier: BSD-3-Clause
import re
import xml.etree.ElementTree as ET

import pytest
import yaml

from fleet_manager.config.fleet_file import read_fleet, read_fleet_and_mistakes
from fleet_manager.config.fleet_launch import launch_text
from hive_common.errors import FileError
from hive_common.landmark import Landmark
from hive_common.structuring import structure
from hive_common.zone import Zone

GOOD = """\
cost_model: time
robots:
  - name: amy
    model: mir100
    pose: [1, 2, 0]
  - name: bob
    model: ld60
    pose: [3.5, 2, 1.57]
"""


@pytest.fixture
def refusal(tmp_path):
    """Return what is said of a fleet file's text, without the folder."""

    def read(text):
        path = tmp_path / "mine.yaml"
        path.write_text(text, encoding="utf-8")
        with pytest.raises(FileError) as caught:
            read_fleet(str(path))
        return str(caught.value).replace(str(tmp_path), "")

    return read


@pytest.mark.parametrize(("name", "models"), [("lab", 4), ("warehouse", 4), ("mixed", 3)])
def test_the_fleets_that_come_along_are_good(name, models):
    fleet = read_fleet(name)

    assert len(fleet.robots) >= 4
    assert len({robot.model for robot in fleet.robots}) == models


def test_a_fleet_file_holds_what_it_says_and_defaults_for_the_rest(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(GOOD, encoding="utf-8")

    fleet = read_fleet(str(path))

    assert [robot.name for robot in fleet.robots] == ["amy", "bob"]
    assert fleet.robots[1].pose == (3.5, 2.0, 1.57)
    assert (fleet.cost_model, fleet.distance, fleet.bid_timeout) == ("time", "path", 2.0)


def test_a_name_that_is_no_fleet_lists_those_there_are():
    known = "lab, mixed, warehouse"
    with pytest.raises(FileError, match=f"fleet 'kitchen': not known; allowed: {known}"):
        read_fleet("kitchen")


def test_a_path_that_is_no_file_is_said(tmp_path):
    with pytest.raises(FileError, match=r"no\.yaml: cannot be read"):
        read_fleet(str(tmp_path / "no.yaml"))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mir100", "tractor", ["/mine.yaml:4: robots[0].model", "tractor", "fetch, ld60, mir100"]),
        ("name: bob", "name: amy", ["/mine.yaml:6: robots[1].name", "'amy'", "robots[0]"]),
        ("name: bob", "name: my-bob", ["/mine.yaml:6: robots[1].name", "'my-bob'", "underscores"]),
        ("name: bob", "name: 2nd", ["/mine.yaml:6: robots[1].name", "'2nd'", "a letter"]),
        ("name: bob", "name: blackboard", ["/mine.yaml:6: robots[1].name", "another part"]),
        ("name: bob", "name: 7", ["/mine.yaml:6: robots[1].name", "7"]),
        ("[3.5, 2, 1.57]", "[3.5, 2]", ["/mine.yaml:8: robots[1].pose", "[x, y, yaw]"]),
        ("[3.5, 2, 1.57]", "[a, 2, 0]", ["/mine.yaml:8: robots[1].pose[0]", "'a'", "a number"]),
        ("[3.5, 2, 1.57]", "[1.1, 2, 0]", ["/mine.yaml:8: robots[1].pose", "0.10 m from amy"]),
        ("[3.5, 2, 1.57]", "[.nan, 2, 0]", ["/mine.yaml:8:", ".nan"]),
        ("cost_model: time", "cost_model: luck", ["/mine.yaml:1: cost_model", "report"]),
        ("cost_model: time", "decision: mine", ["/mine.yaml:1: decision", "mine", "centralized"]),
        ("cost_model: time", "bid_timeout: -1", ["/mine.yaml:1: bid_timeout", "-1", "0.1..60"]),
        ("cost_model: time", "stand_by: 1", ["/mine.yaml:1: stand_by", "1", "2..10000"]),
        ("cost_model: time", "processes: two", ["/mine.yaml:1: processes", "two", "shared"]),
        ("cost_model: time", "navigation: theirs", ["/mine.yaml:1: navigation", "ours | none"]),
        ("cost_model: time", "plan: /a b", ["/mine.yaml:1: plan", "'/a b'", "NavfnROS/plan"]),
        ("model: ld60", "model: ld60\n    navigation: no", ["robots[1].navigation", "ours"]),
        ("cost_model: time", "colour: red", ["/mine.yaml:1:", "colour"]),
        (
            "cost_model: time",
            "traffic: wild",
            ["/mine.yaml:1: traffic", "wild", "local | planned"],
        ),
    ],
)
def test_a_mistake_is_one_line_with_file_line_key_and_what_is_allowed(refusal, old, new, words):
    said = refusal(GOOD.replace(old, new))

    assert "\n" not in said
    for word in words:
        assert word in said


@pytest.mark.parametrize(
    "text", ["", "[]", "robots: []", "robots: amy", "robots: [amy]", "a: b: c"]
)
def test_a_file_of_another_form_is_refused_in_one_line(refusal, text):
    assert "\n" not in refusal(text)


def test_the_launch_file_starts_the_blackboard_and_each_robot_with_the_fleets_values():
    fleet = read_fleet("lab")

    root = ET.fromstring(launch_text(fleet, sim=False))  # noqa: S314  (made here)

    includes = root.findall("include")
    files = [include.get("file") for include in includes]
    values = [{arg.get("name"): arg.get("value") for arg in include} for include in includes]
    told = {param.get("name"): param.get("value") for param in root.findall("param")}
    assert told == {
        "fleet/cost_model": fleet.cost_model,
        "fleet/distance": "path",
        "charging/critical": "0.15",
        "charging/low": "0.3",
        "charging/enough": "0.6",
        "charging/full": "0.95",
    }
    assert root.find("rosparam").text == "[]"
    assert files[0].endswith("blackboard.launch")
    assert values[0] == {
        "decision": "planned",
        "improve_by": "waiting",
        "distance": "path",
        "bid_timeout": "2",
        "traffic": "planned",
    }
    assert [one["name"] for one in values[1:]] == [robot.name for robot in fleet.robots]
    assert values[1]["model"] == "mir100"
    assert (values[1]["x"], values[1]["sim"]) == ("2.6", "false")


def launched(text, tmp_path, **options):
    """Return the launch file of a fleet file's text: what is included, each with its values."""
    path = tmp_path / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    root = ET.fromstring(launch_text(read_fleet(str(path)), **options))  # noqa: S314  (made here)
    return [
        (include.get("file").rpartition("/")[2], {a.get("name"): a.get("value") for a in include})
        for include in root.iter("include")
    ]


def robots_of(included):
    return {values["name"]: values for file, values in included if file == "robot.launch"}


STOCK = GOOD.replace("  - name: bob\n", "  - name: bob\n    names: stock\n")


def test_a_robot_with_stock_names_has_a_navigation_of_its_own(tmp_path):
    robots = robots_of(launched(STOCK, tmp_path, sim=False))

    assert robots["bob"]["names"] == "stock"
    assert not {"navigation", "localization", "plan"} & set(robots["bob"])
    assert "names" not in robots["amy"]


def test_its_path_is_found_where_no_namespace_is(tmp_path):
    text = STOCK.replace("names: stock", "names: stock\n    plan: move_base/Teb/plan")

    assert robots_of(launched(text, tmp_path, sim=False))["bob"]["plan"] == "/move_base/Teb/plan"


def test_all_robots_may_have_stock_names(tmp_path):
    robots = robots_of(launched("names: stock\n" + GOOD, tmp_path, sim=False))

    assert [robots[name]["names"] for name in ("amy", "bob")] == ["stock", "stock"]


def test_in_the_simulator_stock_names_do_not_count(tmp_path):
    included = launched("processes: each\n" + STOCK, tmp_path, sim=True, chart="lab")

    assert "names" not in robots_of(included)["bob"]
    assert ("map_server.launch", {"map": "lab", "respawn": "true"}) in included


@pytest.mark.parametrize(
    ("machine", "served"), [((), False), (("bob",), False), (("amy",), True)], ids=str
)
def test_the_map_is_that_of_a_robot_with_stock_names_where_it_is_on_the_machine(
    tmp_path, machine, served
):
    included = launched(STOCK, tmp_path, sim=False, machine=machine, chart="lab")

    assert ("map_server.launch" in {file for file, _ in included}) is served


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("navigation: ours", ["navigation", "'ours'", "names: stock", "none"]),
        ("localization: amcl", ["localization", "'amcl'", "names: stock", "none"]),
        ("driver: vda5050", ["names", "'stock'", "vda5050", "leave names out"]),
    ],
)
def test_what_stock_names_exclude_is_refused(refusal, line, words):
    said = refusal(STOCK.replace("names: stock", f"names: stock\n    {line}"))

    assert all(word in said for word in words)


def test_an_agv_is_not_meant_by_the_names_of_the_fleet(tmp_path):
    text = GOOD.replace("  - name: bob\n", "  - name: bob\n    driver: vda5050\n")

    assert list(robots_of(launched("names: stock\n" + text, tmp_path, sim=False))) == ["amy"]


@pytest.mark.parametrize("name", ["lab", "mixed"])
@pytest.mark.parametrize("sim", [True, False])
def test_a_fleet_is_launched_in_whatever_namespace_its_launch_file_is(name, sim):
    root = ET.fromstring(launch_text(read_fleet(name), sim=sim))  # noqa: S314  (made here)

    names = {tag.get(key, "") for tag in root.iter() for key in ("name", "param", "ns")}
    assert {each for each in names if each.startswith("/")} == set()


def test_the_first_robots_stand_by_to_carry_the_blackboard(tmp_path):
    path = tmp_path / "mine.yaml"
    carol = "  - {name: carol, model: mir100, pose: [9, 2, 0]}\n"
    path.write_text(f"stand_by: 2\n{GOOD.rstrip()}\n{carol}", encoding="utf-8")

    root = ET.fromstring(launch_text(read_fleet(str(path)), sim=False))  # noqa: S314  (made here)

    told = [arg.get("value") for arg in root.iterfind(".//arg[@name='stands_by']")]
    assert told == ["true", "true", "false"]


def test_every_robot_is_told_the_chargers_and_thresholds_of_the_file(tmp_path):
    path = tmp_path / "mine.yaml"
    more = "battery: {low: 0.4}\nchargers: [{name: dock, pose: [1, 2, 0]}]\n"
    path.write_text(more + GOOD, encoding="utf-8")

    root = ET.fromstring(launch_text(read_fleet(str(path)), sim=False))  # noqa: S314  (made here)

    told = yaml.safe_load(root.find("rosparam").text)
    assert root.find("param[@name='charging/low']").get("value") == "0.4"
    assert told == [{"name": "dock", "pose": [1.0, 2.0, 0.0]}]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("battery: {low: 0.1}", r"mine.yaml:\d+: battery: .*each above the one before"),
        ("battery: {low: 3}", r":\d+: battery.low: 3; allowed: a level above 0 and at most 1"),
        (
            "battery: {empty: 0.1}",
            r":\d+: battery.empty: unknown; allowed: the keys critical, low",
        ),
        ("chargers: [{name: dock}]", r"chargers\[0\].pose: missing"),
    ],
)
def test_a_bad_battery_or_charger_is_refused_with_its_line(tmp_path, text, message):
    path = tmp_path / "mine.yaml"
    path.write_text(f"{text}\n{GOOD}", encoding="utf-8")

    with pytest.raises(FileError, match=message):
        read_fleet(str(path))


ZONES = """\
zones:
  - {name: north aisle, kind: one-way, corners: [[1, 1], [9, 1], [9, 2], [1, 2]], direction: 3.14}
  - name: door
    kind: at-most
    corners: [[4, 4], [5, 4], [5, 5]]
    robots: 1
    closed: true
"""


def test_a_fleet_file_names_zones(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(ZONES + GOOD, encoding="utf-8")

    aisle, door = read_fleet(str(path)).zones

    assert (aisle.name, aisle.kind, aisle.direction, aisle.closed) == (
        "north aisle", "one-way", 3.14, False,
    )  # fmt: skip
    assert (door.kind, door.robots, door.closed) == ("at-most", 1, True)
    assert door.corners == ((4, 4), (5, 4), (5, 5))


def test_the_traffic_planner_is_told_the_zones_as_they_were_read(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(ZONES + GOOD, encoding="utf-8")
    fleet = read_fleet(str(path))

    root = ET.fromstring(launch_text(fleet, sim=False))  # noqa: S314  (made here)

    told = yaml.safe_load(root.find("rosparam[@param='traffic_planner/zones']").text)
    assert tuple(structure(each, Zone) for each in told) == fleet.zones


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("at-most", "fast", r":4: zones\[1\].kind: 'fast'; allowed: one-way \| keep-out \| slow"),
        ("robots: 1", "robots: 0", r":6: zones\[1\].robots: 0; allowed: a number of robots, 1"),
        ("    robots: 1\n", "", r":3: zones\[1\].robots: missing; allowed: a number of robots"),
        (
            "robots: 1",
            "robots: 1\n    speed: 0.3",
            r":7: zones\[1\].speed: 0.3; .*the kind slow",
        ),
        ("direction: 3.14", "direction: 90", r":2: zones\[0\].direction: 90; .*\[rad\]"),
        ("[5, 4], [5, 5]", "[5, 4]", r":5: zones\[1\].corners: .*at least 3 corners \[x, y\]"),
        ("[5, 5]", "[5]", r":5: zones\[1\].corners\[2\]: .*\[x, y\] in the map frame \[m\]"),
        ("[5, 5]", "[6, 4]", r":5: zones\[1\].corners: an area of 0 m\^2"),
        ("[9, 2], [1, 2]", "[1, 2], [9, 2]", r":2: zones\[0\].corners: .*edges that cross"),
        ("name: door", "name: north aisle", r":3: zones\[1\].name: .*the name of zones\[0\]"),
        ("closed: true", "closed: maybe", r":7: zones\[1\].closed: .*true or false"),
        ("closed: true", "colour: red", r":7: zones\[1\].colour: unknown; .*name, kind, corners"),
    ],
)
def test_a_bad_zone_is_one_line_with_file_line_key_and_what_is_allowed(refusal, old, new, message):
    said = refusal(ZONES.replace(old, new) + GOOD)

    assert "\n" not in said
    assert re.search(f"^/mine.yaml{message}", said), said


def test_what_is_special_in_xml_stays_what_it_is(tmp_path):
    model = tmp_path / 'a "<&> model.yaml'
    mir = read_fleet("lab").path.parents[2] / "robot_description/models/mir100.yaml"
    model.write_text(mir.read_text(encoding="utf-8"), encoding="utf-8")
    path = tmp_path / "mine.yaml"
    path.write_text(GOOD.replace("mir100", f"'{model}'"), encoding="utf-8")

    root = ET.fromstring(launch_text(read_fleet(str(path)), sim=False))  # noqa: S314  (made here)

    assert root.findall("include")[1].find("arg[@name='model']").get("value") == str(model)


def hosts_of(root):
    """Return the robots of each host that a launch file starts."""
    hosts = root.findall("node[@type='robot_host']")
    assert len({host.get("name") for host in hosts}) == len(hosts)
    return [yaml.safe_load(host.find("rosparam").text) for host in hosts]


@pytest.fixture
def crowd(tmp_path):
    """A fleet file with twelve robots, of which two stand by."""
    robots = [
        f"  - {{name: r{number}, model: mir100, pose: [{2 * number}, 2, 0]}}"
        for number in range(12)
    ]
    path = tmp_path / "crowd.yaml"
    path.write_text("\n".join(["stand_by: 2", "robots:", *robots]), encoding="utf-8")
    return path


def test_simulated_robots_share_processes_ten_in_each(crowd):
    pytest.importorskip("xacro")

    root = ET.fromstring(launch_text(read_fleet(str(crowd)), sim=True))  # noqa: S314  (made here)

    hosts = hosts_of(root)
    assert [len(robots) for robots in hosts] == [10, 2]
    assert hosts[1][1] == {
        "name": "r11",
        "model": "mir100",
        "pose": [22.0, 2.0, 0.0],
        "localization": "fake_localization",
        "navigation": "ours",
    }
    assert len(root.findall("include")) == 1


def test_a_robot_that_shares_a_process_has_the_parameters_of_one_that_does_not(crowd):
    pytest.importorskip("xacro")

    root = ET.fromstring(launch_text(read_fleet(str(crowd)), sim=True))  # noqa: S314  (made here)

    files = {each.get("ns"): each.get("file") for each in root.findall("rosparam[@ns]")}
    assert files["r1/move_base"].endswith("hive_navigation)/config/move_base.yaml")
    assert files["r1/robot"].endswith("blackboard)/config/robot.yaml")
    assert files["r1/characteristics"].endswith("models/mir100.yaml")
    told = yaml.safe_load(root.find("rosparam[@param='r2/robot']").text)
    assert told == {"cost_model": "report", "distance": "path", "stands_by": False}
    assert "r2/base_footprint" in root.find("param[@name='r2/robot_description']").get("value")


def test_robots_that_find_themselves_by_laser_are_told_where_they_start(crowd):
    pytest.importorskip("xacro")
    crowd.write_text("localization: amcl\n" + crowd.read_text(encoding="utf-8"), encoding="utf-8")

    root = ET.fromstring(launch_text(read_fleet(str(crowd)), sim=True))  # noqa: S314  (made here)

    assert hosts_of(root)[0][0]["localization"] == "amcl"
    assert yaml.safe_load(root.find("rosparam[@param='r3/amcl']").text) == {
        "initial_pose_x": 6.0,
        "initial_pose_y": 2.0,
        "initial_pose_a": 0.0,
    }


@pytest.mark.parametrize(
    ("sim", "line"), [(False, "processes: shared"), (True, "processes: each")]
)
def test_real_robots_and_those_of_a_fleet_that_says_so_share_no_process(crowd, sim, line):
    crowd.write_text(f"{line}\n" + crowd.read_text(encoding="utf-8"), encoding="utf-8")

    root = ET.fromstring(launch_text(read_fleet(str(crowd)), sim=sim))  # noqa: S314  (made here)

    assert hosts_of(root) == []
    assert len(root.findall("include")) == 13


def test_the_traffic_planner_is_told_the_landmarks(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(GOOD, encoding="utf-8")
    landmark = Landmark(name="the north door", at=(5.0, 6.1), is_goal=False)

    text = launch_text(read_fleet(str(path)), sim=True, landmarks=[landmark])
    root = ET.fromstring(text)  # noqa: S314  (made here)

    told = yaml.safe_load(root.find("rosparam[@param='traffic_planner/places']").text)
    assert structure(told, tuple[Landmark, ...]) == (landmark,)


FOREIGN = """\
localization: amcl
robots:
  - name: amy
    model: mir100
    pose: [1, 2, 0]
  - name: bob
    model: ld60
    pose: [3.5, 2, 1.57]
    navigation: none
    localization: none
  - name: cat
    model: ld60
    pose: [6, 2, 0]
    navigation: none
    plan: move_base/GlobalPlanner/plan
"""


def foreign(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(FOREIGN, encoding="utf-8")
    return read_fleet(str(path))


def test_a_robot_may_have_navigation_and_localization_of_its_own(tmp_path):
    amy, bob, cat = foreign(tmp_path).robots

    assert (amy.navigation, amy.localization) == ("ours", "amcl")
    assert (bob.navigation, bob.localization) == ("none", "none")
    assert (cat.navigation, cat.localization) == ("none", "amcl")


def test_each_robots_launch_file_is_told_whose_navigation_it_has(tmp_path):
    root = ET.fromstring(launch_text(foreign(tmp_path), sim=False))  # noqa: S314  (made here)
    includes = [i for i in root.findall("include") if i.get("file").endswith("robot.launch")]
    amy, bob, cat = ({arg.get("name"): arg.get("value") for arg in one} for one in includes)

    assert (amy["navigation"], amy["localization"]) == ("ours", "amcl")
    assert (bob["navigation"], bob["localization"]) == ("none", "none")
    assert "plan" not in bob
    assert cat["plan"] == "move_base/GlobalPlanner/plan"


def test_a_hosted_robot_without_our_navigation_has_no_parameters_of_move_base(tmp_path):
    root = ET.fromstring(launch_text(foreign(tmp_path), sim=True))  # noqa: S314  (made here)
    loaded = {tag.get("ns") for tag in root.findall("rosparam") if tag.get("ns")}
    told = {tag.get("name"): tag.get("value") for tag in root.findall("param")}
    host = root.find("node/rosparam[@param='robots']")

    assert "amy/move_base" in loaded
    assert not {"bob/move_base", "cat/move_base"} & loaded
    assert {name for name in loaded if name.endswith("amcl")} == {"amy/amcl", "cat/amcl"}
    assert told["bob/plan_topic"] == "move_base/NavfnROS/plan"
    assert told["cat/plan_topic"] == "move_base/GlobalPlanner/plan"
    assert "amy/plan_topic" not in told
    assert [robot["navigation"] for robot in yaml.safe_load(host.text)] == ["ours", "none", "none"]


def test_all_mistakes_of_a_file_are_found(tmp_path):
    path = tmp_path / "mine.yaml"
    text = ZONES + GOOD.replace("mir100", "tractor").replace("bob", "blackboard")
    path.write_text(text, encoding="utf-8")

    _, mistakes = read_fleet_and_mistakes(str(path))

    assert [str(each).split(": ")[1] for each in mistakes] == ["robots[1].name", "robots[0].model"]


def test_bases_that_stand_side_by_side_do_not_overlap(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(GOOD.replace("ld60", "mir100").replace("[3.5, 2, 1.57]", "[1, 2.6, 0]"))

    assert len(read_fleet(str(path)).robots) == 2
