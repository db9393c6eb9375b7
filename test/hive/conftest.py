# SPDX-License-Identifier: BSD-3-Clause
"""One hypothesis profile: the same examples in every run, on every machine."""

from hypothesis import settings

settings.register_profile(
    "fixed", derandomize=True, database=None, deadline=None, max_examples=150, print_blob=False
)
settings.load_profile("fixed")
