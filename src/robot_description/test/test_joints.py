# SPDX-License-Identifier: BSD-3-Clause
"""The fixed joints of a URDF."""

import math

import pytest

from robot_description.joints import fixed_joints

URDF = """
<robot name="robot">
  <joint name="a" type="fixed"><parent link="r/base"/><child link="r/laser"/>
    <origin xyz="0.1 0.2 0.3" rpy="0 0 1.5707963267948966"/></joint>
  <joint name="b" type="fixed"><parent link="r/base"/><child link="r/arm"/></joint>
  <joint name="c" type="revolute"><parent link="r/arm"/><child link="r/hand"/></joint>
</robot>
"""


def test_a_fixed_joint_says_where_the_child_is_in_the_parent():
    laser = fixed_joints(URDF)[0]

    assert laser[:3] == ("r/base", "r/laser", (0.1, 0.2, 0.3))
    assert laser.rotation == pytest.approx((0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))


def test_a_joint_without_origin_is_at_the_parents_and_one_that_moves_is_left_out():
    joints = fixed_joints(URDF)

    assert [joint.child for joint in joints] == ["r/laser", "r/arm"]
    assert joints[1][2:] == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("rpy", "rotation"),
    [
        ("3.141592653589793 0 0", (1.0, 0.0, 0.0, 0.0)),
        ("0 3.141592653589793 0", (0.0, 1.0, 0.0, 0.0)),
        ("1.5707963267948966 1.5707963267948966 0", (0.5, 0.5, -0.5, 0.5)),
    ],
)
def test_roll_pitch_and_yaw_turn_about_fixed_axes_in_this_order(rpy, rotation):
    urdf = URDF.replace("0 0 1.5707963267948966", rpy)

    assert fixed_joints(urdf)[0].rotation == pytest.approx(rotation, abs=1e-9)
