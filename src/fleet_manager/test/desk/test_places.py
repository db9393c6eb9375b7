# SPDX-License-Identifier: BSD-3-Clause
import math

from fleet_manager.desk.places import Place, place_of
from hive_common.pose import Pose


def test_a_robot_is_at_the_nearest_place_if_it_is_near_enough():
    places = (Place("dock", Pose(1, 1)), Place("bench", Pose(2, 1)))

    assert place_of(Pose(1.6, 1), places) == "bench"
    assert place_of(Pose(5, 5), places) == ""
    assert place_of(Pose(math.nan, 5), places) == ""
    assert place_of(Pose(1, 1), ()) == ""
