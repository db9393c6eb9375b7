# SPDX-License-Identifier: BSD-3-Clause
"""Case 7 of the report's test plan: the blackboard node is killed, and the backup takes over.

The cases of plan_tasks.py run after it, with the blackboard on the backup: case 8.
"""

import time

import pytest
from blackboard.msg import TaskMsg, TaskState
from hive_operator import ROBOTS, slow_motion, task
from launching import kill


@pytest.mark.plan(
    "7",
    "Killing the blackboard node: the backup process",
    "a member, by rule the named backup, is active with a higher epoch (how soon is measured by "
    "`hive bench failover`); no task is lost; the one under way goes on with the same robot, new "
    "ones are taken in",
)
def test_the_backup_takes_over_and_no_task_is_lost(operator, observed):
    members = len(ROBOTS) + 1
    operator.expect(
        lambda: (
            operator.heartbeat
            and operator.heartbeat.backup
            and len(operator.heartbeat.members) == members
        ),
        f"a backup and {members} members on bb_backup",
        lambda: operator.heartbeat,
    )
    goals = ((5.5, 4.0, 0.0), (8.8, 3.2, 0.0))
    with slow_motion():
        operator.post(task("P7-under-way", TaskMsg.GAB, *goals))
        worker = operator.until("P7-under-way", TaskState.STARTED).robot_id
        before = operator.heartbeat
        kill(before.active)
        killed = time.monotonic()
        operator.post(task("P7-new", TaskMsg.GA, (5.5, 4.0, 0.0), payload=58.0))
        operator.expect(
            lambda: operator.heartbeat.active != before.active,
            f"another active blackboard than {before.active}",
            lambda: operator.heartbeat,
        )
    after = operator.heartbeat
    gap = operator.actives[after.active] - killed
    finisher = operator.follow("P7-under-way").robot_id
    observed(
        f"{after.active} active {gap:.2f} s after {before.active} was killed, named as its backup "
        f"was {before.backup}; epoch {before.epoch} to {after.epoch}; P7-under-way begun by "
        f"{worker}, done by {finisher}"
    )

    assert after.active in before.members
    assert after.epoch > before.epoch
    assert operator.follow("P7-under-way").state == TaskState.DONE
    assert {u.robot_id for u in operator.updates["P7-under-way"] if u.robot_id} == {worker}
    assert operator.follow("P7-new").state == TaskState.DONE
