# SPDX-License-Identifier: BSD-3-Clause
"""Valid messages with a few odd fields end no member, and the next good task is done."""

import pytest

pytest.importorskip("blackboard.msg", reason="needs generated messages: ./hive test hive")

import rospy

from blackboard.ros.codec.tables import WIRES
from hive_lab.fuzz.run import fuzz

MESSAGES = 2000


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    """Give rospy its clock back afterwards."""
    for name in ("_rostime_initialized", "_rostime_current"):
        monkeypatch.setattr(rospy.rostime, name, getattr(rospy.rostime, name))


@pytest.mark.parametrize("seed", range(1, 11))
def test_odd_messages_on_every_topic_end_nobody_and_the_next_task_is_done(seed):
    found = fuzz(seed, MESSAGES)

    assert not found.failures, found.failures[0]
    assert found.messages.total() == MESSAGES
    assert set(found.messages) == set(WIRES)
    assert MESSAGES / 10 < found.refused < MESSAGES / 2
