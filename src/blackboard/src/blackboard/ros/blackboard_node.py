# SPDX-License-Identifier: BSD-3-Clause
"""The node that carries the blackboard."""

from __future__ import annotations

import sys

import rospy

from blackboard import talker as topics
from blackboard.backup import Backup
from blackboard.blackboard import Blackboard
from blackboard.errors import BlackboardError
from blackboard.ros import params
from blackboard.ros.talker import RosTalker
from blackboard.ros.ways import make_ways
from blackboard.settings import BackupSettings, BlackboardSettings, WaysSettings

_SPEAKS = (
    topics.TASK_BROADCAST,
    topics.TASK_ASSIGN,
    topics.TASK_STATE,
    topics.ROBOT_STATUS,
    topics.BACKUP,
    topics.SYNC,
)


def main() -> None:
    """Run the blackboard until the node is shut down.

    ROS Subscribers: `new_task`, `task_cancel`, `task_cost`, `task_state`, `robot_status`, `map`.
    ROS Publishers: `task_bc`, `task_assign`, `task_state`, `robot_status`, `bb_backup`, `bb_sync`.
    ROS Parameters: see config/blackboard.yaml.
    """
    rospy.init_node("blackboard")
    try:
        kinds = (BlackboardSettings, BackupSettings, WaysSettings)
        params.refuse_unknown(kinds)
        settings = params.read(BlackboardSettings)
        hive = rospy.get_namespace()
        talker = RosTalker(hive, _SPEAKS)
        ways = make_ways(talker, hive, 0.0, params.read(WaysSettings))
        backup = Backup(talker, rospy.get_name(), params.read(BackupSettings))
    except BlackboardError as error:
        rospy.logfatal(str(error))
        sys.exit(1)
    except rospy.ROSInterruptException:
        return
    Blackboard(talker, backup, ways, settings).start()
    backup.start()
    talker.spin()
