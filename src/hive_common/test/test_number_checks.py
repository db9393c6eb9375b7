# SPDX-License-Identifier: BSD-3-Clause
"""Numbers of settings are checked against their ranges."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import pytest

from hive_common.errors import ParameterError
from hive_common.number_checks import check_numbers


@dataclass
class Settings:
    """Settings with a number of each kind."""

    period: float = 1.0
    delay: float = 0.0
    share: float = 1.0
    offset: float = -1.0
    name: str = "a"


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"period": 0.0}, "period: 0.0; allowed: a number above 0"),
        ({"delay": -0.1}, "delay: -0.1; allowed: a number of at least 0"),
        ({"share": 1.1}, "share: 1.1; allowed: a number from 0 to 1"),
        ({"offset": math.nan}, "offset: nan; allowed: a finite number"),
        ({"offset": True}, "offset: True; allowed: a finite number"),
    ],
)
def test_a_number_out_of_its_range_is_named_with_what_is_allowed(wrong, said):
    ranges = {"above_zero": ["period"], "at_least_zero": ["delay"], "shares": ["share"]}

    check_numbers(Settings(), **ranges)
    with pytest.raises(ParameterError, match=re.escape(said)):
        check_numbers(Settings(**wrong), **ranges)
