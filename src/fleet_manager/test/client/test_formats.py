# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import math

import pytest

from fleet_manager.client import formats
from hive_common.pose import Pose


@pytest.mark.parametrize(
    ("seconds", "shown"),
    [
        (None, "–"),
        (math.nan, "–"),
        (-5, "0 s"),
        (59.4, "59 s"),
        (59.6, "1 min 00 s"),
        (3600, "1 h 00 min"),
        (90061, "1 d 01 h"),
    ],
)
def test_a_time_span_is_shown_in_the_units_that_matter(seconds, shown):
    assert formats.duration(seconds) == shown


@pytest.mark.parametrize(
    ("moment", "now", "shown"),
    [
        (990.0, 1000.0, "10 s ago"),
        (1000.5, 1000.0, "0 s ago"),
        (1010.0, 1000.0, "before the clock was set back"),
        (1010.0, 0.0, "–"),
    ],
)
def test_how_long_ago_something_was_is_not_claimed_while_the_clock_is_unknown(moment, now, shown):
    assert formats.ago(moment, now) == shown


def test_every_number_has_its_unit():
    assert formats.mass(12.5) == "12.5 kg"
    assert formats.mass(math.nan) == "–"
    assert formats.percent(0.874) == "87 %"
    assert formats.position(Pose(1, 2.345)) == "1.00 m, 2.35 m"
    assert formats.degrees(math.pi / 2) == "90°"
    assert formats.charge_used(0.0123) == "0.012 Ah"


def test_names_are_sorted_by_the_numbers_in_them():
    assert sorted(["T10", "T9", "robot2", "T7.10", "T7.9"], key=formats.natural) == [
        "T7.9",
        "T7.10",
        "T9",
        "T10",
        "robot2",
    ]
