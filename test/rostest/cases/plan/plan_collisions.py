# SPDX-License-Identifier: BSD-3-Clause
"""What has to hold after the cases of every file in which the lab's fleet drives."""

import pytest


@pytest.mark.plan(
    "collisions", "Driving safely", "after all that no robot has touched anything or anybody"
)
def test_after_all_that_no_robot_has_touched_anything(operator, observed):
    operator.expect(lambda: operator.collisions is not None, "a count of collisions")
    observed(f"{operator.collisions} collisions")

    assert operator.collisions == 0
