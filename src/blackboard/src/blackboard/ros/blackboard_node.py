# SPDX-License-Identifier: BSD-3-Clause
"""The node that carries the blackboard."""

from __future__ import annotations

import sys

import rospy

from blackboard.domain.settings import BlackboardSettings, PathSettings, RaftSettings
from blackboard.errors import BlackboardError
from blackboard.ros import membership, params
from blackboard.ros.path_lengths import RosPathLengths
from blackboard.ros.rospy_patches import handshakes
from blackboard.ros.rospy_patches.prompt_sending import send_promptly
from blackboard.ros.rospy_patches.shared_reading import read_together
from blackboard.ros.talker import RosTalker
from hive_common.ros.links import mend_links
from hive_common.ros.signals import end_on_signals


def main() -> None:
    """Run the blackboard until the node is shut down.

    It founds the hive where there is none yet; otherwise it is a member like every robot.

    ROS Subscribers: `new_task`, `task_cancel`, `task_cost`, `task_state`, `robot_status`, `map`,
        `bb_backup`, `bb_entries`, `bb_ack`, `bb_vote`.
    ROS Publishers: `new_task`, `task_bc`, `task_assign`, `task_state`, `robot_status`,
        `bb_backup`, `bb_sync`, `bb_entries`, `bb_ack`, `bb_vote`.
    ROS Parameters: see config/blackboard.yaml.
    """
    end_on_signals()
    rospy.init_node("blackboard", disable_signals=True)
    handshakes.take_each_apart()
    send_promptly()
    read_together()
    mend_links()
    try:
        kinds = (BlackboardSettings, RaftSettings, PathSettings)
        params.refuse_unknown(kinds, ["journal"])
        hive = rospy.get_namespace()
        journal = membership.open_journal()
        talker = RosTalker(hive, membership.SPEAKS)
        ways = RosPathLengths(talker, hive, params.read(PathSettings))
        backup = membership.join(talker, hive, ways, journal, founds=True)
    except BlackboardError as error:
        rospy.logfatal(str(error))
        sys.exit(1)
    except rospy.ROSInterruptException:
        return
    backup.start()
    talker.spin()
