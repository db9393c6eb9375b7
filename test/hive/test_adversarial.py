# SPDX-License-Identifier: BSD-3-Clause
"""With a traffic planner, robots get through small layouts that are hard for traffic; no ROS."""

from __future__ import annotations

import pytest

pytest.importorskip("ompl")

from hive_lab.fleets.adversarial import WITHIN, draw, drive

LAYOUTS = 100  # `hive bench traffic --adversarial` drives in 2000

LONGEST_STAND = WITHIN / 2
"""What no lock lasts [s]. How long one really lasts is for the benchmark to tell: numbers that are
rounded otherwise, as by another release of Debian, lead to other runs."""


@pytest.mark.parametrize("seed", range(LAYOUTS))
def test_robots_get_through_every_layout_that_a_complete_search_solves(seed):
    layout = draw(seed)

    solved = drive(layout, seed)

    assert solved.reached == solved.asked, str(layout)
    assert solved.contacts == 0, str(layout)
    assert solved.longest_stand <= LONGEST_STAND, str(layout)
