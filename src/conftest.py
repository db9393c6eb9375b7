# SPDX-License-Identifier: BSD-3-Clause
"""What all unit tests share: one profile for properties, and a rospy that is not shut down."""

import sys

import pytest
from hypothesis import settings

settings.register_profile(
    "fixed", derandomize=True, database=None, deadline=None, max_examples=30, print_blob=False
)
settings.load_profile("fixed")


@pytest.fixture(autouse=True)
def _rospy_runs(monkeypatch):
    """Let no test find rospy shut down by another one in the same process."""
    core = sys.modules.get("rospy.core")
    if core is not None:
        monkeypatch.setattr(core, "_shutdown_flag", False)
        monkeypatch.setattr(core, "_in_shutdown", False)
