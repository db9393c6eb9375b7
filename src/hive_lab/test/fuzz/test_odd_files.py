# SPDX-License-Identifier: BSD-3-Clause
"""Files with odd values are refused in one line, or can be used."""

from __future__ import annotations

from random import Random

import pytest

from hive_common.structuring import NotAllowedError
from hive_lab.fuzz.odd_files import READERS, damaged, fuzz_files
from robot_description.joints import fixed_joints
from robot_description.urdf import robot_urdf

FILES = 150


@pytest.mark.slow
@pytest.mark.parametrize("kind", READERS)
def test_a_file_with_odd_values_is_refused_in_words_or_works(kind: str) -> None:
    found = fuzz_files(kind, 1, FILES)

    assert not found.failures, found.failures[0]
    assert found.refused > FILES / 2
    assert found.taken > FILES / 20


def test_a_damaged_urdf_is_refused_in_words_or_read() -> None:
    random, good, refused = Random(1), robot_urdf("fetch", "robot1/").encode(), 0
    for _ in range(4 * FILES):
        data, what = damaged(good, random)
        try:
            fixed_joints(data.decode(errors="replace"))
        except NotAllowedError:
            refused += 1
        except Exception as error:
            raise AssertionError(what) from error

    assert 2 * FILES < refused < 4 * FILES
