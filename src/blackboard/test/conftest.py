# SPDX-License-Identifier: BSD-3-Clause
"""What several tests of this package share."""

import queue

import pytest

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
