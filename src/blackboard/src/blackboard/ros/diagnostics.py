# SPDX-License-Identifier: BSD-3-Clause
"""Publishes the health of a member on /diagnostics, for rqt_runtime_monitor and the like.

It does without diagnostic_updater, which asks the ROS master for a parameter at every update: a
member has to go on without a master.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from blackboard.consensus.member import Role, name_of
from blackboard.domain.clock_offsets import words
from blackboard.ros.master_watch import MasterState, watch_master

if TYPE_CHECKING:
    from blackboard.consensus.no_quorum import NoQuorum
    from blackboard.consensus.node import RaftNode
    from blackboard.process.talker import MemberTalker
    from blackboard.ros.no_clock import NoClock

_PERIOD = 1.0
"""Time between two messages, as is usual on /diagnostics [s]."""


class Diagnostics:
    """Publishes a member's role, what its hive lacks, what it refused, and what has failed.

    ROS Publishers: `/diagnostics` (diagnostic_msgs/DiagnosticArray): OK; WARN while the ROS master
        is gone or the clock of somebody whom the member hears is off, and once the handling of a
        message has failed; ERROR while the hive has no quorum, the member cannot write to its
        disk, or no time comes although `/use_sim_time` is true.
    """

    def __init__(
        self, talker: MemberTalker, node: RaftNode, no_quorum: NoQuorum, no_clock: NoClock
    ) -> None:
        self._talker = talker
        self._node = node
        self._lacks = (no_quorum, no_clock)
        self._master_is_lost = False
        self._publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)

    def start(self) -> None:
        """Begin to publish and to watch the master."""
        watch_master(lambda state: self._talker.call(lambda: self._hear_master(state)))
        self._talker.every(_PERIOD, self._publish)
        rospy.on_shutdown(self._log_refusals)

    def _hear_master(self, state: MasterState) -> None:
        self._master_is_lost = state is MasterState.LOST
        if self._master_is_lost:
            rospy.logerr(
                "the ROS master does not answer: the hive goes on and fails over without it, but "
                "nodes that start now cannot join; start a master again at the same address"
            )
        else:
            rospy.logwarn("the ROS master answers again and knows this node")

    def _publish(self) -> None:
        message = DiagnosticArray(status=[self._status()])
        message.header.stamp = rospy.Time.now()
        self._publisher.publish(message)

    def _status(self) -> DiagnosticStatus:
        member = self._node.member
        refusals, failures = self._talker.refusals, self._talker.failures
        level, text = self._verdict()
        values = {
            "role": member.role.value,
            "epoch": member.epoch,
            "leader": member.leader,
            "members": ", ".join(map(name_of, member.members)),
            "refused": refusals.total,
            **{f"refused on {topic}": n for topic, n in sorted(refusals.by_topic().items())},
            "failed": failures.total,
            **{f"failed on {topic}": n for topic, n in sorted(failures.by_topic().items())},
        }
        return DiagnosticStatus(
            level=level,
            name=f"{self._talker.name.strip('/')}: hive",
            message=text,
            hardware_id="none",
            values=[KeyValue(key, str(value)) for key, value in values.items()],
        )

    def _verdict(self) -> tuple[int, str]:
        member = self._node.member
        if lacks := "; ".join(each.text for each in self._lacks if each.text):
            return DiagnosticStatus.ERROR, lacks
        if self._master_is_lost:
            return DiagnosticStatus.WARN, "the ROS master does not answer"
        if clocks := self._talker.clocks.off(self._talker.now()):
            texts = [f"the clock of {name} is {words(late)} mine" for name, late in clocks.items()]
            return DiagnosticStatus.WARN, "; ".join(texts)
        if failed := self._talker.failures.total:
            text = f"the handling of {failed} messages failed, which is a defect: see the log"
            return DiagnosticStatus.WARN, text
        if member.role is Role.LEADER:
            return DiagnosticStatus.OK, "carries the blackboard"
        return DiagnosticStatus.OK, f"follows {member.leader}" if member.leader else "waits"

    def _log_refusals(self) -> None:
        for (topic, reason), count in self._talker.refusals.counts.items():
            rospy.loginfo(f"refused on {topic}, {count} times: {reason}")
