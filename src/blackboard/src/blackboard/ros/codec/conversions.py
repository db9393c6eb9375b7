# SPDX-License-Identifier: BSD-3-Clause
"""The one border between ROS messages and the core's values.

Every topic of the hive has a `Wire`: its message type, and how to get a core value out of a
message and into one. Stamps are written here, so the core knows no ROS time.
"""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import rospy
from std_msgs.msg import Header, String

import blackboard.msg as bb_msgs
from blackboard.consensus.task_list import TaskList
from blackboard.costing.bid_basis import Bids
from blackboard.costing.path_lengths import Grid
from blackboard.domain import talker as topics
from blackboard.domain.bid import MAX_COST, Bid, CostTerms
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import Broadcast, Order, OrderKind, TaskUpdate
from blackboard.domain.task import TaskState
from blackboard.ros.codec.basis_conversions import basis_from_msg, basis_to_msg
from blackboard.ros.codec.charger_conversions import CHARGER_WIRES
from blackboard.ros.codec.hive_conversions import HIVE_WIRES
from blackboard.ros.codec.records import (
    pose_from_msg,
    pose_to_msg,
    record_from_msg,
    record_to_msg,
    task_from_msg,
    task_to_msg,
)
from blackboard.ros.codec.wire import Wire

if TYPE_CHECKING:
    from collections.abc import Mapping

OCCUPIED_FROM = 50
"""Cells of a map at least this occupied [%] count as blocked, and so do unknown ones."""


def _header(frame: str = "") -> Header:
    return Header(stamp=rospy.Time.now(), frame_id=frame)


def yaw_of(quaternion: Any) -> float:  # noqa: ANN401  (a message type)
    """Return the heading [rad] that a geometry_msgs/Quaternion stands for in the plane."""
    q = quaternion
    return math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))


def _order_to_msg(order: Order) -> bb_msgs.TaskMsg:
    msg = task_to_msg(order.task)
    msg.robot_id = order.robot_id
    msg.order = order.kind.value
    msg.step = order.step
    msg.epoch = order.epoch
    msg.assignment = order.assignment
    msg.heard = order.heard
    msg.hive = order.hive
    return msg


def _order_from_msg(msg: bb_msgs.TaskMsg) -> Order:
    if msg.order not in {kind.value for kind in OrderKind}:
        raise ValueError(f"order {msg.order} is unknown")
    return Order(
        task=task_from_msg(msg),
        robot_id=msg.robot_id,
        kind=OrderKind(msg.order),
        step=msg.step,
        epoch=msg.epoch,
        assignment=msg.assignment,
        heard=msg.heard,
        hive=msg.hive,
    )


def _broadcast_to_msg(broadcast: Broadcast) -> bb_msgs.TaskMsgArray:
    tasks = []
    for task, step in broadcast.tasks:
        msg = task_to_msg(task)
        msg.step = step
        tasks.append(msg)
    return bb_msgs.TaskMsgArray(
        header=_header(),
        epoch=broadcast.epoch,
        auction=broadcast.auction,
        tasks=tasks,
        hive=broadcast.hive,
        round=broadcast.round,
        robots=list(broadcast.asked or ()),
        given=list((broadcast.asked or {}).values()),
        basis=broadcast.basis,
        sizes=list(broadcast.sizes),
    )


def _broadcast_from_msg(msg: bb_msgs.TaskMsgArray) -> Broadcast:
    tasks = tuple((task_from_msg(task), task.step) for task in msg.tasks)
    asked = dict(zip(msg.robots, msg.given, strict=True)) if msg.robots else None
    return Broadcast(
        msg.epoch,
        msg.auction,
        tasks,
        msg.hive,
        round=msg.round,
        asked=asked,
        basis=msg.basis,
        sizes=tuple(msg.sizes),
    )


def _bid_to_msg(bid: Bid, header: Header, epoch: int) -> bb_msgs.TaskCost:
    msg = bb_msgs.TaskCost(
        header=header,
        robot_id=bid.robot_id,
        task_id=bid.task_id,
        cost=bid.cost,
        energy_cost=bid.energy_cost,
        eta=bid.eta,
        epoch=epoch,
        reason=bid.reason,
        under_way=bid.under_way,
        interrupt_cost=bid.interrupt_cost,
        most_payload=bid.most_payload,
        exclusion=bid.exclusion,
        size=bid.size,
    )
    if bid.terms is not None:
        msg.place = bid.terms.place
        msg.way = bid.terms.way
        msg.charge_left = bid.terms.charge_left
        msg.finish = bid.terms.finish
        msg.waiting = bid.terms.waiting
        msg.added_charge = bid.terms.added_charge
    return msg


def _terms_from_msg(msg: bb_msgs.TaskCost) -> CostTerms | None:
    if not msg.place:
        return None
    return CostTerms(
        msg.energy_cost,
        msg.charge_left,
        msg.place,
        msg.way,
        msg.eta,
        msg.finish,
        msg.waiting,
        msg.added_charge,
    )


def _bids_to_msg(bids: Bids) -> bb_msgs.TaskCostArray:
    header = _header()
    costs = [_bid_to_msg(bid, header, bids.epoch) for bid in bids.bids]
    return bb_msgs.TaskCostArray(
        header,
        bids.robot_id,
        bids.epoch,
        bids.auction,
        costs,
        bids.round,
        [] if bids.basis is None else [basis_to_msg(bids.basis)],
    )


def _bids_from_msg(msg: bb_msgs.TaskCostArray) -> Bids:
    bids = tuple(
        Bid(
            msg.robot_id,
            cost.task_id,
            cost.cost,
            cost.energy_cost,
            cost.eta,
            cost.reason,
            cost.under_way,
            cost.interrupt_cost if cost.under_way else MAX_COST,
            cost.most_payload,
            _terms_from_msg(cost),
            cost.exclusion,
            cost.size or 1,
        )
        for cost in msg.costs
    )
    basis = basis_from_msg(msg.basis[0]) if msg.basis else None
    return Bids(msg.robot_id, msg.epoch, msg.auction, bids, msg.round, basis)


def _update_to_msg(update: TaskUpdate) -> bb_msgs.TaskState:
    return bb_msgs.TaskState(
        header=_header(),
        task_id=update.task_id,
        state=update.state,
        robot_id=update.robot_id,
        step=update.step,
        steps=update.steps,
        eta=update.eta,
        epoch=update.epoch,
        reason=update.reason,
        assignment=update.assignment,
        step_eta=update.step_eta,
        put_off_for=update.put_off_for,
    )


def _update_from_msg(msg: bb_msgs.TaskState) -> TaskUpdate:
    return TaskUpdate(
        task_id=msg.task_id,
        state=TaskState(msg.state),
        robot_id=msg.robot_id,
        step=msg.step,
        steps=msg.steps,
        eta=msg.eta,
        epoch=msg.epoch,
        reason=msg.reason,
        assignment=msg.assignment,
        step_eta=msg.step_eta,
        put_off_for=msg.put_off_for,
    )


def _status_to_msg(status: RobotStatus) -> bb_msgs.RobotStatus:
    return bb_msgs.RobotStatus(
        header=_header("map"),
        robot_id=status.robot_id,
        state=status.state,
        pose=pose_to_msg(status.pose),
        charge=status.charge,
        payload=status.payload,
        task_id=status.task_id,
        queued=len(status.tasks) - bool(status.task_id),
        reason=status.reason,
        tasks=list(status.tasks),
        sent=status.sent,
        hive=status.hive,
    )


def _status_from_msg(msg: bb_msgs.RobotStatus) -> RobotStatus:
    return RobotStatus(
        robot_id=msg.robot_id,
        state=RobotState(msg.state),
        pose=pose_from_msg(msg.pose),
        charge=msg.charge,
        payload=msg.payload,
        task_id=msg.task_id,
        reason=msg.reason,
        tasks=tuple(msg.tasks),
        sent=msg.sent,
        hive=msg.hive,
    )


def _list_to_msg(known: TaskList) -> bb_msgs.BbSynch:
    records = [record_to_msg(record) for record in known.records]
    return bb_msgs.BbSynch(_header("map"), known.epoch, known.version, records, known.hive)


def _list_from_msg(msg: bb_msgs.BbSynch) -> TaskList:
    return TaskList(msg.epoch, msg.version, tuple(map(record_from_msg, msg.tasks)), msg.hive)


def _text(msg: String) -> str:
    return str(msg.data)


WIRES: Mapping[str, Wire] = MappingProxyType(
    {
        topics.NEW_TASK: Wire(bb_msgs.TaskMsg, task_to_msg, task_from_msg),
        topics.TASK_BROADCAST: Wire(bb_msgs.TaskMsgArray, _broadcast_to_msg, _broadcast_from_msg),
        topics.TASK_COST: Wire(bb_msgs.TaskCostArray, _bids_to_msg, _bids_from_msg),
        topics.TASK_ASSIGN: Wire(bb_msgs.TaskMsg, _order_to_msg, _order_from_msg),
        topics.TASK_STATE: Wire(bb_msgs.TaskState, _update_to_msg, _update_from_msg),
        topics.TASK_CANCEL: Wire(String, String, _text),
        topics.ROBOT_STATUS: Wire(bb_msgs.RobotStatus, _status_to_msg, _status_from_msg),
        topics.SYNC: Wire(bb_msgs.BbSynch, _list_to_msg, _list_from_msg, latched=True),
        topics.SET_STATE: Wire(String, String, _text),
        **HIVE_WIRES,
        **CHARGER_WIRES,
    }
)
"""How the messages of every topic of the hive are made and read."""


def grid_from_msg(msg: Any) -> Grid:  # noqa: ANN401  (OccupancyGrid, possibly with a numpy array)
    """Read a nav_msgs/OccupancyGrid; its origin's heading has to be 0, as map_server writes it."""
    shape = (msg.info.height, msg.info.width)
    occupied = np.asarray(msg.data, dtype=np.int8).reshape(shape)
    corner = msg.info.origin.position
    blocked = (occupied < 0) | (occupied >= OCCUPIED_FROM)
    return Grid(blocked, msg.info.resolution, corner.x, corner.y)
