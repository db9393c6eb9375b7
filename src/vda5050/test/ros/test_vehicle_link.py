# SPDX-License-Identifier: BSD-3-Clause
import pytest

pytest.importorskip("rospy")

from vda5050.ros.vehicle_link import round_at

STEP = 25_000_000  # of the simulator [ns]


def test_a_round_begins_in_the_very_step_that_its_command_is_due_in():
    rounds = [round_at(number * STEP * 1e-9) for number in range(40_000)]

    assert rounds == [number // 4 for number in range(40_000)]
