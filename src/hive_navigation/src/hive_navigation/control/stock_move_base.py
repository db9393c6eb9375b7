# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of ROS's own `move_base` for a robot model: costmap_2d, navfn and dwa_local_planner.

The names are those of the navigation stack of ROS Noetic (1.17). What a model does not say is as
in the stack's own documentation; the comments in the text name what is worth tuning.
"""

from __future__ import annotations

import json
import math
from string import Template
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from robot_description.models import RobotModel

MARGIN = 0.15  # kept between a robot and what its laser sees, beyond its footprint [m]
BEYOND = 0.2  # how much less far obstacles are marked than the laser reaches [m]
SAMPLES_ALONG, SAMPLES_TURN = 8, 20

FIRST_STEP = 0.1
"""Period of the controller [s]. DWA considers what the robot reaches within it: were its lowest
speed higher than that, it would never leave a standstill."""

_TEXT = Template("""\
# ROS's own move_base for ${robot}, a ${model}.
# Made by `rosrun hive_navigation move_base_params`.
base_global_planner: navfn/NavfnROS
base_local_planner: dwa_local_planner/DWAPlannerROS
controller_frequency: 10.0
planner_frequency: 0.5   # plans anew while driving, so that it finds another way [Hz]
planner_patience: 5.0   # [s]
controller_patience: 15.0   # [s]
oscillation_timeout: 20.0   # [s]
oscillation_distance: 0.3   # [m]

global_costmap: &costmap
  global_frame: map
  robot_base_frame: ${robot}/base_footprint
  update_frequency: 2.0   # [Hz]
  publish_frequency: 0.5   # [Hz]
  transform_tolerance: 0.5   # [s]
  footprint: ${footprint}
  footprint_padding: 0.02   # [m]
  plugins:
    - {name: static_layer, type: "costmap_2d::StaticLayer"}
    - {name: obstacle_layer, type: "costmap_2d::ObstacleLayer"}
    - {name: inflation_layer, type: "costmap_2d::InflationLayer"}
  static_layer: {map_topic: /map}
  obstacle_layer: &scan
    observation_sources: scan
    scan:
      topic: /${robot}/scan
      data_type: LaserScan
      marking: true
      clearing: true
      inf_is_valid: true   # a beam that hits nothing clears its way
      obstacle_range: ${marked}
      raytrace_range: ${reach}
  inflation_layer: &inflation
    inflation_radius: ${inflation}   # [m]
    cost_scaling_factor: 5.0   # lower keeps further from walls

local_costmap:
  <<: *costmap
  global_frame: ${robot}/odom
  update_frequency: 10.0
  publish_frequency: 2.0
  rolling_window: true
  width: ${side}   # [m]
  height: ${side}
  resolution: 0.05   # [m]
  plugins:
    - {name: obstacle_layer, type: "costmap_2d::ObstacleLayer"}
    - {name: inflation_layer, type: "costmap_2d::InflationLayer"}

NavfnROS:
  allow_unknown: false
  default_tolerance: 0.0   # the hive's goals are exact [m]

DWAPlannerROS:
  max_vel_x: ${speed}   # within what the laser sees it stops from here [m/s]
  min_vel_x: ${backwards}
  max_vel_y: ${sideways}
  min_vel_y: ${backwards}
  max_vel_trans: ${speed}
  min_vel_trans: ${slow}
  max_vel_theta: ${yaw_rate}   # [rad/s]
  min_vel_theta: ${slow_turn}
  acc_lim_x: ${acceleration}   # [m/s^2]
  acc_lim_y: ${sideways_acceleration}
  acc_lim_trans: ${acceleration}
  acc_lim_theta: ${yaw_acceleration}   # [rad/s^2]
  trans_stopped_vel: 0.05   # [m/s]
  theta_stopped_vel: 0.1   # [rad/s]
  xy_goal_tolerance: 0.1   # as the hive's own move_base [m]
  yaw_goal_tolerance: 0.1   # [rad]
  latch_xy_goal_tolerance: true
  sim_time: ${horizon}   # at least as long as stopping takes [s]
  vx_samples: ${samples}
  vy_samples: ${samples_across}
  vth_samples: ${samples_turn}
  path_distance_bias: 32.0
  goal_distance_bias: 24.0
  occdist_scale: 0.02
""")


def top_speed(model: RobotModel) -> float:
    """Return the speed from which a robot still stops within what its laser sees [m/s].

    The braking distance is v^2 / (2 a), plus 0.5 s of driving until it brakes.
    """
    base, room = model.base, model.laser.range_max - BEYOND - model.base.circumscribed_radius
    if room <= 0:
        return base.max_speed
    late = 0.5 * base.acceleration
    return min(base.max_speed, math.sqrt(late**2 + 2 * base.acceleration * room) - late)


def stock_parameters(model: RobotModel, robot: str) -> str:
    """Return the parameters as YAML, to be loaded in the namespace of the node `move_base`.

    Args:
        model: The robot's model; its figures are in SI units.
        robot: The robot's name, which is its namespace and the prefix of its frames.
    """
    base, speed = model.base, top_speed(model)
    reach = model.laser.range_max
    figures = {
        "marked": reach - BEYOND,
        "reach": reach,
        "side": 2 * reach,
        "inflation": base.circumscribed_radius + MARGIN,
        "speed": speed,
        "slow": min(0.1, base.acceleration * FIRST_STEP / 2),
        "sideways": speed if base.holonomic else 0.0,
        "backwards": -speed if base.holonomic else 0.0,
        "yaw_rate": base.max_yaw_rate,
        "slow_turn": min(0.3, base.yaw_acceleration * FIRST_STEP / 2),
        "acceleration": base.acceleration,
        "sideways_acceleration": base.acceleration if base.holonomic else 0.0,
        "yaw_acceleration": base.yaw_acceleration,
        "horizon": max(1.5, speed / base.acceleration + 0.5),
    }
    return _TEXT.substitute(
        {name: f"{value:.2f}" for name, value in figures.items()},
        robot=robot,
        model=model.name,
        footprint=json.dumps([list(corner) for corner in base.footprint]),
        samples=SAMPLES_ALONG,
        samples_across=SAMPLES_ALONG if base.holonomic else 1,
        samples_turn=SAMPLES_TURN,
    )
