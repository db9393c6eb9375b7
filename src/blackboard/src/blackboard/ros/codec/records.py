# SPDX-License-Identifier: BSD-3-Clause
"""The border between ROS messages and tasks: what was posted, and where it stands."""

from __future__ import annotations

import functools

import rospy
from geometry_msgs.msg import Pose2D
from std_msgs.msg import Header

import blackboard.msg as bb_msgs
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState
from hive_common.pose import Pose

_RECORDS_KEPT = 4096


def pose_to_msg(pose: Pose) -> Pose2D:
    """Make a Pose2D [m, m, rad]."""
    return Pose2D(x=pose.x, y=pose.y, theta=pose.yaw)


def pose_from_msg(msg: Pose2D) -> Pose:
    """Read a Pose2D [m, m, rad]."""
    return Pose(msg.x, msg.y, msg.theta)


def task_to_msg(task: Task) -> bb_msgs.TaskMsg:
    """Make a TaskMsg, as it was posted."""
    header = Header(stamp=rospy.Time.from_sec(task.posted), frame_id=task.frame)
    return bb_msgs.TaskMsg(
        header=header,
        id=task.id,
        type=task.type,
        priority=task.priority,
        payload=task.payload,
        goals=[pose_to_msg(goal) for goal in task.goals],
    )


def task_from_msg(msg: bb_msgs.TaskMsg) -> Task:
    """Read a TaskMsg, whatever it holds: the blackboard checks it."""
    return Task(
        id=msg.id,
        type=msg.type,
        goals=tuple(map(pose_from_msg, msg.goals)),
        priority=msg.priority,
        payload=msg.payload,
        frame=msg.header.frame_id,
        posted=msg.header.stamp.to_sec(),
    )


@functools.lru_cache(maxsize=_RECORDS_KEPT)
def record_to_msg(record: TaskRecord) -> bb_msgs.TaskRecord:
    """Make a TaskRecord, which nobody may change: the same record gives the same one again.

    The task list is told at every change, and hardly anything in it has changed.
    """
    return bb_msgs.TaskRecord(
        task=task_to_msg(record.task),
        state=record.state,
        robot=record.robot,
        step=record.step,
        eta=record.eta,
        reason=record.reason,
        parent=record.parent,
        assignment=record.assignment,
        tried=list(record.tried),
        step_eta=record.step_eta,
        parts=record.parts,
        earlier=record.earlier,
    )


def record_from_msg(msg: bb_msgs.TaskRecord) -> TaskRecord:
    """Read a TaskRecord."""
    return TaskRecord(
        task=task_from_msg(msg.task),
        state=TaskState(msg.state),
        robot=msg.robot,
        step=msg.step,
        eta=msg.eta,
        reason=msg.reason,
        parent=msg.parent,
        assignment=msg.assignment,
        tried=tuple(msg.tried),
        step_eta=msg.step_eta,
        parts=msg.parts,
        earlier=msg.earlier,
    )
