# SPDX-License-Identifier: BSD-3-Clause
"""Valid messages with a few odd fields end no member, and the next good task is done."""

import pytest

pytest.importorskip("blackboard.msg", reason="needs generated messages: ./hive test hive")

import rospy

from blackboard.codec.tables import WIRES
from blackboard.domain.talker import ROBOT_STATUS
from blackboard.domain.task import TaskType
from hive_lab.fuzz.hive_at_work import HiveAtWork
from hive_lab.fuzz.run import fuzz

MESSAGES = 2000


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    """Give rospy its clock back afterwards."""
    for name in ("_rostime_initialized", "_rostime_current"):
        monkeypatch.setattr(rospy.rostime, name, getattr(rospy.rostime, name))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 11))
def test_odd_messages_on_every_topic_end_nobody_and_the_next_task_is_done(seed):
    found = fuzz(seed, MESSAGES)

    assert not found.failures, found.failures[0]
    assert found.messages.total() == MESSAGES
    assert set(found.messages) == set(WIRES)
    assert MESSAGES / 10 < found.refused < MESSAGES / 2


def test_a_robot_that_falls_silent_at_a_task_off_its_own_list_ends_no_leader():
    hive = HiveAtWork(1, "distributed")
    hive.network.run(5.0)
    name, data = next(each for each in reversed(hive.said[ROBOT_STATUS]) if b"robot4" in each[1])
    status = WIRES[ROBOT_STATUS].message().deserialize(data)
    status.task_id, status.tasks = "T99", []
    hive.kill("robot4")
    hive.deliver(name, ROBOT_STATUS, status)
    hive.network.run(30.0)

    assert hive.does(hive.post(TaskType.GA), within=60.0)
    assert [talker.failures.total for talker in hive.talkers] == [0] * len(hive.talkers)
