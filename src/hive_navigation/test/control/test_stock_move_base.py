# SPDX-License-Identifier: BSD-3-Clause
import pytest
import yaml

from hive_navigation.control.stock_move_base import stock_parameters, top_speed
from robot_description.models import load_model, model_names


def parameters(model, robot="robot5"):
    return yaml.safe_load(stock_parameters(load_model(model), robot))


@pytest.mark.parametrize("name", model_names())
def test_every_model_gets_its_footprint_frames_and_limits(name):
    model, given = load_model(name), parameters(name)

    for costmap in (given["global_costmap"], given["local_costmap"]):
        assert [tuple(corner) for corner in costmap["footprint"]] == list(model.base.footprint)
        assert costmap["robot_base_frame"] == "robot5/base_footprint"
        assert costmap["obstacle_layer"]["scan"]["topic"] == "/robot5/scan"
    assert given["local_costmap"]["global_frame"] == "robot5/odom"
    assert given["global_costmap"]["global_frame"] == "map"
    drive = given["DWAPlannerROS"]
    assert drive["max_vel_theta"] == pytest.approx(model.base.max_yaw_rate, abs=0.01)
    assert 0 < drive["max_vel_x"] <= model.base.max_speed + 0.01
    assert 0 < drive["min_vel_trans"] < drive["max_vel_trans"]
    period = 1 / given["controller_frequency"]
    assert drive["min_vel_trans"] <= drive["acc_lim_trans"] * period
    assert drive["min_vel_theta"] <= drive["acc_lim_theta"] * period


@pytest.mark.parametrize("name", model_names())
def test_a_robot_stops_within_what_its_laser_sees(name):
    model = load_model(name)
    speed, brake = top_speed(model), model.base.acceleration

    room = model.laser.range_max - model.base.circumscribed_radius
    assert speed**2 / (2 * brake) + 0.5 * speed <= room


def test_obstacles_are_marked_where_the_laser_reaches_and_no_further():
    scan = parameters("mir100")["local_costmap"]["obstacle_layer"]["scan"]

    assert scan["obstacle_range"] < scan["raytrace_range"]
    assert scan["raytrace_range"] == load_model("mir100").laser.range_max


def test_only_a_holonomic_base_drives_sideways():
    assert parameters("mir100")["DWAPlannerROS"]["max_vel_y"] == 0
    assert parameters("mir100")["DWAPlannerROS"]["min_vel_x"] == 0
    assert parameters("mir100")["DWAPlannerROS"]["vy_samples"] == 1
    assert parameters("youbot")["DWAPlannerROS"]["max_vel_y"] > 0


def test_the_local_costmap_rolls_and_has_no_map():
    local = parameters("mir100")["local_costmap"]

    assert local["rolling_window"] is True
    assert [layer["name"] for layer in local["plugins"]] == ["obstacle_layer", "inflation_layer"]
