# SPDX-License-Identifier: BSD-3-Clause
"""What lasers of several makes measure becomes one kind of scan, or is refused with a reason."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from robot_description.models import load_model
from robot_description.scan import MAX_BEAMS, Scan, ScanError


def message(**fields: object) -> SimpleNamespace:
    """Return a LaserScan that is good but for some fields."""
    good = {
        "angle_min": -math.pi,
        "angle_increment": math.tau / 360,
        "range_min": 0.1,
        "range_max": 3.5,
        "ranges": [1.0] * 360,
    }
    return SimpleNamespace(**good | fields)


def test_each_beam_has_the_direction_that_the_message_says() -> None:
    scan = Scan.from_msg(message(angle_min=0.5, angle_increment=-0.25, ranges=[1.0, 2.0, 3.0]))

    assert scan.angles.tolist() == [0.5, 0.25, 0.0]
    assert scan.ranges.tolist() == [1.0, 2.0, 3.0]
    assert scan.range_max == 3.5


def test_a_range_is_a_distance_or_nothing_in_range_or_unknown() -> None:
    measured = [1.0, 3.5, 9.0, math.inf, 0.05, 0.0, -1.0, -math.inf, math.nan]

    scan = Scan.from_msg(message(ranges=np.array(measured, dtype=np.float32)))

    nothing, unknown = math.inf, math.nan
    np.testing.assert_array_equal(scan.ranges, [1.0, *[nothing] * 3, *[unknown] * 5])


def test_a_range_of_0_is_unknown_even_if_the_laser_says_that_it_measures_from_0() -> None:
    scan = Scan.from_msg(message(range_min=0.0, ranges=[0.0, 1.0]))

    np.testing.assert_array_equal(scan.ranges, [math.nan, 1.0])


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("angle_min", math.nan),
        ("angle_min", math.inf),
        ("angle_increment", 0.0),
        ("angle_increment", math.nan),
        ("angle_increment", -math.inf),
        ("range_min", math.nan),
        ("range_max", math.inf),
        ("range_max", math.nan),
        ("range_max", 0.1),
        ("range_max", -1.0),
        ("ranges", []),
        ("ranges", [1.0] * 362),
        ("ranges", [math.nan] * 360),
        ("ranges", [0.0, -1.0, 0.05, -math.inf]),
    ],
)
def test_a_message_that_contradicts_itself_or_is_blind_is_refused(
    field: str, value: object
) -> None:
    with pytest.raises(ScanError, match="; allowed: ") as refused:
        Scan.from_msg(message(**{field: value}))

    assert refused.value.field == field


def test_more_beams_than_any_laser_has_are_refused_however_close_they_are() -> None:
    with pytest.raises(ScanError, match="ranges: 100001; allowed: 1 to 100000 beams"):
        Scan.from_msg(message(angle_increment=1e-320, ranges=np.ones(MAX_BEAMS + 1)))


def test_a_whole_turn_may_measure_its_first_direction_twice() -> None:
    twice = np.float32(math.tau / 360)

    assert len(Scan.from_msg(message(angle_increment=twice, ranges=[1.0] * 361)).ranges) == 361


def test_a_laser_that_is_made_to_see_less_far_has_nothing_in_range_beyond() -> None:
    scan = Scan.from_msg(message(ranges=[1.0, 2.0, 3.0, math.nan])).within(2.0)

    np.testing.assert_array_equal(scan.ranges, [1.0, math.inf, math.inf, math.nan])
    assert scan.range_max == 2.0
    assert scan.within(9.0) is scan


def test_the_beams_of_a_model_begin_at_minus_half_its_view() -> None:
    laser = load_model("mir100").laser

    scan = Scan.of(laser, np.ones(laser.beams))

    assert scan.angles[0] == -laser.field_of_view / 2
    assert scan.angles[laser.beams // 2] == pytest.approx(0.0)
