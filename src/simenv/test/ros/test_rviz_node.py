# SPDX-License-Identifier: BSD-3-Clause
import math

import pytest
import rospy
import yaml
from geometry_msgs.msg import Quaternion
from nav_msgs.msg import MapMetaData

pytest.importorskip("rospy", reason="needs ROS")

from hive_common.errors import MapError
from hive_common.map_file import load_map
from hive_common.pose import Pose
from hive_common.resources import package_folder
from hive_common.ros.conversions import quaternion_of
from simenv.ros import rviz_node
from simenv.ros.rviz_node import MOST_SHOWN, fitted, with_robots

HIVE = (package_folder("simenv") / "rviz/hive.rviz").read_text()


def parts(config):
    content = yaml.safe_load(config)
    return content["Visualization Manager"]["Views"]["Current"], content["Window Geometry"]


@pytest.mark.parametrize("size", [(20.0, 12.0), (60.0, 40.0), (5.0, 100.0)])
def test_the_whole_map_fits_into_the_window(size):
    view, window = parts(fitted(HIVE, Pose(-3.0, 7.0, 0.0), size))

    assert size[0] * view["Scale"] < window["Width"]
    assert size[1] * view["Scale"] < window["Height"]
    assert (view["X"], view["Y"]) == (-3.0 + size[0] / 2, 7.0 + size[1] / 2)


@pytest.mark.parametrize(
    ("orientation", "middle"),
    [(quaternion_of(math.pi / 2), (-3.0, 17.0)), (Quaternion(), (10.0, 6.0))],
)
def test_a_map_that_is_turned_is_shown_where_it_is_and_an_odd_one_changes_no_view(
    monkeypatch, orientation, middle
):
    info = MapMetaData(width=400, height=200, resolution=0.05)
    info.origin.position.x, info.origin.position.y = 2.0, 7.0
    info.origin.orientation = orientation
    monkeypatch.setattr(rospy, "wait_for_message", lambda *_, **__: info)
    monkeypatch.setattr(rospy, "logwarn", lambda _: None)

    view, _ = parts(rviz_node._fit(HIVE, 1.0))  # noqa: SLF001  (rest: a ROS master)

    assert (view["X"], view["Y"]) == pytest.approx(middle)


def test_nothing_else_is_changed():
    before, after = yaml.safe_load(HIVE), yaml.safe_load(fitted(HIVE, Pose(0, 0, 0), (60, 40)))

    for content in (before, after):
        del content["Visualization Manager"]["Views"]
    assert before == after


def test_the_configuration_shows_the_whole_lab_as_it_is():
    grid = load_map("lab")
    height, width = grid.cells.shape
    size = (width * grid.resolution, height * grid.resolution)

    as_it_is, _ = parts(HIVE)
    fitted_to_the_lab, _ = parts(fitted(HIVE, grid.origin, size))

    assert as_it_is["Scale"] <= fitted_to_the_lab["Scale"]
    assert (as_it_is["X"], as_it_is["Y"]) == (fitted_to_the_lab["X"], fitted_to_the_lab["Y"])


@pytest.mark.parametrize("config", ["", "Panels: []", "Window Geometry: {Width: 3, Height: 4}"])
def test_a_configuration_without_view_is_refused(config):
    with pytest.raises(MapError, match=r"take hive\.rviz"):
        fitted(config, Pose(0, 0, 0), (20.0, 12.0))


def test_a_map_without_size_is_refused():
    with pytest.raises(MapError, match="must have a size"):
        fitted(HIVE, Pose(0, 0, 0), (0.0, 12.0))


def groups(config):
    displays = yaml.safe_load(config)["Visualization Manager"]["Displays"]
    return [each for each in displays if each["Class"] == "rviz/Group"]


def test_every_robot_of_the_hive_has_its_body_its_laser_and_its_path_in_its_colour():
    config = with_robots(HIVE, {"amy": "move_base/plan", "robot7": "move_base/NavfnROS/plan"})

    assert [group["Name"] for group in groups(config)] == ["amy", "robot7"]
    body, laser, path = groups(config)[1]["Displays"]
    assert body["Robot Description"] == "robot7/robot_description"
    assert laser["Topic"] == "robot7/scan"
    assert path["Topic"] == "robot7/move_base/NavfnROS/plan"
    assert laser["Color"] == path["Color"] == "204; 120; 166"
    assert "robot1" not in config


def test_a_path_s_topic_may_lie_outside_the_robot_s_namespace():
    (group,) = groups(with_robots(HIVE, {"amy": "/planner/plan"}))

    assert group["Displays"][2]["Topic"] == "/planner/plan"


@pytest.mark.parametrize(
    "config",
    [
        "",
        "a: 1",
        "Visualization Manager: {Displays: [{Name: Grid}]}",
        "Visualization Manager: {Displays: [7]}",
        "Visualization Manager: {Displays: [{Class: rviz/Group}]}",
    ],
)
def test_a_configuration_without_displays_is_refused(config):
    with pytest.raises(MapError, match=r"no list of displays; take hive\.rviz"):
        with_robots(config, {"amy": "plan"})


def test_of_a_large_fleet_the_groups_are_switched_off():
    few = with_robots(HIVE, {f"robot{n}": "plan" for n in range(MOST_SHOWN)})
    many = with_robots(HIVE, {f"robot{n}": "plan" for n in range(MOST_SHOWN + 1)})

    assert all(group["Enabled"] for group in groups(few))
    assert not any(group["Enabled"] for group in groups(many))


def test_without_a_fleet_the_configuration_stays_as_it_is():
    assert with_robots(HIVE, {}) == HIVE
    assert (
        with_robots("Visualization Manager: {Displays: []}", {"robot1": "plan"}).count("Group")
        == 0
    )
