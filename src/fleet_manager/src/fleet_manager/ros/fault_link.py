# SPDX-License-Identifier: BSD-3-Clause
"""Injects faults on ROS: through the simulator, a robot's topic, or its processes."""

from __future__ import annotations

import os
import signal
import socket
import xmlrpc.client
from typing import TYPE_CHECKING, Any

import rosgraph
import rosgraph.names
import rospy
from blackboard.msg import BbBackup
from simenv.msg import Fault as FaultMsg
from simenv.srv import InjectFault
from std_msgs.msg import Float64

from blackboard.consensus.member import majority_of
from blackboard.domain.talker import BACKUP, SET_STATE
from fleet_manager.client.formats import member
from fleet_manager.errors import InputError
from fleet_manager.ros.client_link import demand_master

if TYPE_CHECKING:
    from collections.abc import Sequence

    from simenv.faults import Fault

_CALLER = "/hive_fault"
_PATIENCE = 5.0  # [s], the longest wait for a simulator or a robot
_LOOK = 0.05  # [s] between two looks
_SENDING = 0.3  # [s] until a published message has left this process


class RosFaultLink:
    """Injects faults into the hive of ROS_MASTER_URI; see `cli.context.FaultLink`."""

    def inject(self, fault: Fault) -> str:
        """Have the simulator inject a fault; return its answer.

        Raises:
            InputError: The simulator refuses, or there is none.
            NoHiveError: No ROS master answers.
        """
        _master()
        try:
            rospy.wait_for_service("simenv/inject_fault", timeout=_PATIENCE)
            call = rospy.ServiceProxy("simenv/inject_fault", InjectFault)
            answer = call(FaultMsg(fault.kind, fault.target, fault.value, list(fault.area)))
        except (rospy.ROSException, rospy.ServiceException):
            raise InputError(
                "no simulator answers on simenv/inject_fault; this fault needs one"
            ) from None
        if not answer.success:
            raise InputError(answer.message)
        return str(answer.message)

    def drop_charge(self, robot: str, level: float) -> str:
        """Let a robot's battery drop to a level from 0 to 1; return a report.

        Raises:
            InputError: There is no such robot.
            NoHiveError: No ROS master answers.
        """
        _master()
        rospy.init_node("hive_fault", anonymous=True, disable_signals=True, log_level=rospy.ERROR)
        publisher = rospy.Publisher(f"{robot}/drop_charge", Float64, queue_size=1, latch=True)
        for _ in range(round(_PATIENCE / _LOOK)):
            if publisher.get_num_connections():
                publisher.publish(Float64(level))
                rospy.rostime.wallsleep(_SENDING)
                return f"{robot}'s battery drops to {level:.0%}"
            rospy.rostime.wallsleep(_LOOK)
        raise InputError(
            f"robot '{robot}': nobody listens on {publisher.resolved_name}; see `hive robots`"
        )

    def vanish(self, robot: str, *, back: bool) -> str:
        """Stop all processes of a robot, or let them go on; return a report.

        Raises:
            InputError: There is no such robot, or it runs on another machine.
            NoHiveError: No ROS master answers.
        """
        master = _master()
        # A stopped process does not answer with its id, so the master keeps the ids.
        note = f"{_namespace(robot)}stopped_processes"
        stopped = master.hasParam(note)
        if back is not stopped:
            raise InputError(
                f"robot '{robot}' is {'stopped already' if stopped else 'not stopped'}"
            )
        pids = master.getParam(note) if stopped else _pids(master, robot)
        for pid in pids:
            os.kill(pid, signal.SIGCONT if back else signal.SIGSTOP)
        if back:
            master.deleteParam(note)
        else:
            master.setParam(note, pids)
        return f"{robot}'s {len(pids)} processes {'go on' if back else 'are stopped'}"

    def kill_leader(self) -> str:
        """Kill the process of the leader; return a report.

        Raises:
            InputError: There is no leader, it runs on another machine, or its process carries so
                many members that those left are no majority.
            NoHiveError: No ROS master answers.
        """
        master = _master()
        rospy.init_node("hive_fault", anonymous=True, disable_signals=True, log_level=rospy.ERROR)
        try:
            beat = rospy.wait_for_message(BACKUP, BbBackup, timeout=_PATIENCE)
        except rospy.ROSException:
            raise InputError(
                f"no leader is heard within {_PATIENCE:g} s; see `hive tasks` for the reason"
            ) from None
        node = str(beat._connection_header["callerid"])  # noqa: SLF001  (rospy has no other way)
        pid, leader = _pid(master, node), member(beat.active)
        carried = _carried(master, node, beat.members)
        left, needed = len(beat.members) - len(carried), majority_of(tuple(beat.members))
        if left < needed:
            raise InputError(
                f"the leader {leader} is not killed: its process {pid} carries {len(carried)} of "
                f"{len(beat.members)} members ({', '.join(map(member, carried))}); {needed} are "
                f"needed to go on, and only {left} would be left: start the fleet with "
                "processes:=each"
            )
        os.kill(pid, signal.SIGKILL)
        hosted = "" if leader == member(node) else f", with every robot of {member(node)}"
        return f"killed the leader {leader}, process {pid}{hosted}"


def _carried(master: rosgraph.Master, node: str, members: Sequence[str]) -> list[str]:
    """Return the members in the process of a node: its own, and those of the robots in it."""
    _, subscribers, _ = master.getSystemState()
    topics = {topic for topic, nodes in subscribers if node in nodes}
    return [
        each
        for each in members
        if each == node or f"{each.rpartition('/')[0]}/{SET_STATE}" in topics
    ]


def _pids(master: rosgraph.Master, robot: str) -> list[int]:
    """Return the processes of all nodes of a robot."""
    publishers, subscribers, _ = master.getSystemState()
    nodes = {node for _, names in (*publishers, *subscribers) for node in names}
    own = _namespace(robot)
    mine = sorted(node for node in nodes if node.startswith(own))
    if not mine and any(name == f"{own}cmd_vel" for name, _ in publishers):
        raise InputError(
            f"robot '{robot}' shares its process with others, which would vanish too; start the "
            "fleet with processes:=each"
        )
    if not mine:
        raise InputError(f"robot '{robot}': no node of it is known; see `hive robots`")
    return [_pid(master, node) for node in mine]


def _namespace(robot: str) -> str:
    """Return the namespace of a robot of this hive, ending in a slash."""
    return f"{rosgraph.names.ns_join(rosgraph.names.get_ros_namespace(), robot)}/"


def _master() -> rosgraph.Master:
    demand_master()
    return rosgraph.Master(_CALLER)


def _pid(master: rosgraph.Master, node: str) -> int:
    """Return the process of a node on this machine."""
    uri = master.lookupNode(node)
    host = uri.split("//")[1].split(":")[0]
    if host not in {socket.gethostname(), "localhost", "127.0.0.1", os.environ.get("ROS_IP", "")}:
        raise InputError(f"{node} runs on {host}; run this command there")
    with xmlrpc.client.ServerProxy(uri) as api:
        answer: Any = api.getPid(_CALLER)
    return int(answer[2])
