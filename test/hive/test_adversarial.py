# SPDX-License-Identifier: BSD-3-Clause
"""With a traffic planner, robots get through small layouts that are hard for traffic; no ROS."""

from __future__ import annotations

import pytest

pytest.importorskip("ompl")

from hive_lab.bench.traffic.adversarial import LONGEST_STAND
from hive_lab.fleets.adversarial import draw, drive

LAYOUTS = 100  # `hive bench traffic --adversarial` drives in 2000


@pytest.mark.parametrize("seed", range(LAYOUTS))
def test_robots_get_through_every_layout_that_a_complete_search_solves(seed):
    layout = draw(seed)

    solved = drive(layout, seed)

    assert solved.reached == solved.asked, str(layout)
    assert solved.contacts == 0, str(layout)
    assert solved.longest_stand <= LONGEST_STAND, str(layout)
