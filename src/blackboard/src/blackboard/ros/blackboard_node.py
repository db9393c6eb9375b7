# SPDX-License-Identifier: BSD-3-Clause
"""The blackboard node: bootstraps a hive where there is none, and else is a member like others."""

from __future__ import annotations

import rospy

from blackboard.domain.settings import (
    BlackboardSettings,
    PathSettings,
    RaftSettings,
    TrafficSettings,
)
from blackboard.domain.talker import VOTER_TOPICS
from blackboard.ros import membership
from blackboard.ros.path_lengths import RosPathLengths
from blackboard.ros.startup import run_node
from blackboard.ros.transport import PARAMETER, make_talker
from hive_common.ros import params


def main() -> None:
    """Run the blackboard until the node is shut down.

    ROS Subscribers: `new_task`, `task_cancel`, `task_cost`, `task_state`, `robot_status`, `map`,
        `bb_backup`, `bb_entries`, `bb_ack`, `bb_vote`.
    ROS Publishers: `new_task`, `task_bc`, `task_assign`, `task_state`, `robot_status`,
        `bb_backup`, `bb_sync`, `bb_entries`, `bb_ack`, `bb_vote`, `/diagnostics`.
    ROS Parameters: see config/blackboard.yaml, and for `zenoh` `transport.make_talker`.
    """
    run_node("blackboard", _run)


def _run() -> None:
    kinds = (BlackboardSettings, RaftSettings, PathSettings, TrafficSettings)
    params.refuse_unknown(kinds, ["journal", PARAMETER])
    hive = rospy.get_namespace()
    journal = membership.open_journal(rospy.get_name())
    talker = make_talker(hive, {}, VOTER_TOPICS)
    member = talker.member(rospy.get_name())
    path_lengths = RosPathLengths(talker, hive, params.read(PathSettings))
    node = membership.join(member, hive, path_lengths, journal, bootstraps=True)
    node.start()
    talker.spin()
