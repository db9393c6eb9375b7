# SPDX-License-Identifier: BSD-3-Clause
"""What all unit tests share: one profile for properties, and a rospy that is not shut down."""

import queue
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


WITHIN = 20.0  # a busy machine needs no longer [s]


@pytest.fixture
def until_heard():
    """Wait until a Zenoh session knows that another one listens to a key."""
    import zenoh  # noqa: PLC0415  (few tests need it)

    def until_heard(session, key):
        changed = queue.Queue()
        publisher = session.declare_publisher(key, allowed_destination=zenoh.Locality.REMOTE)
        listener = publisher.declare_matching_listener(changed.put)
        while not publisher.matching_status.matching:
            changed.get(timeout=WITHIN)
        listener.undeclare()
        publisher.undeclare()

    return until_heard
