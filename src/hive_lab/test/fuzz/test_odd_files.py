# SPDX-License-Identifier: BSD-3-Clause
"""Files with odd values are refused in one line, or can be used."""

from __future__ import annotations

import pytest

from hive_lab.fuzz.odd_files import READERS, fuzz_files

FILES = 150


@pytest.mark.parametrize("kind", READERS)
def test_a_file_with_odd_values_is_refused_in_words_or_works(kind: str) -> None:
    found = fuzz_files(kind, 1, FILES)

    assert not found.failures, found.failures[0]
    assert found.refused > FILES / 2
    assert found.taken > FILES / 20
