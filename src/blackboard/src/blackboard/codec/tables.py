# SPDX-License-Identifier: BSD-3-Clause
"""Tables of which message field holds which attribute of the core, and each topic's message.

`msg/*.msg` describes the messages. Fields named in one string have the type of the attribute.
A header is stamped when the message is sent (`Wire.to_msg`), so the core knows no ROS time.
"""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from itertools import starmap
from operator import attrgetter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import genpy
from geometry_msgs.msg import Pose2D
from std_msgs.msg import Header, String

import blackboard.msg as bb_msgs
from blackboard.codec.engine import Codec, Row, Within
from blackboard.consensus.log import Entry, Position, Snapshot
from blackboard.consensus.messages import AppendEntries, AppendReply, Ballot, BallotKind, Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.costing.bid_basis import BidBasis, Bids
from blackboard.domain import talker as topics
from blackboard.domain.battery import BatteryModel
from blackboard.domain.bid import MAX_COST, Bid, CostTerms
from blackboard.domain.characteristics import RobotCharacteristics, RobotState, RobotStatus
from blackboard.domain.charger import Grant
from blackboard.domain.record import Broadcast, Order, OrderKind, TaskRecord, TaskUpdate
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.map_id import MapId
from hive_common.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

RECORDS_KEPT = 4096
"""The task list is sent at every change, and hardly anything in it has changed."""


# Rows for attributes of other types than their fields.


def _one_of(attribute: str, kind: type[Enum], field: str = "") -> Row:
    """Return the row of a member of an enumeration, whose value is the message's constant."""
    return Row(attribute, field, write=attrgetter("value"), read=_Constants(kind).__getitem__)


class _Constants(dict[int, Enum]):
    """The members of an enumeration by their numbers."""

    def __init__(self, kind: type[Enum]) -> None:
        super().__init__((each.value, each) for each in kind)

    def __missing__(self, number: int) -> Enum:
        raise ValueError(f"{number} is unknown; allowed: {min(self)} to {max(self)}")


def _tuples(names: str) -> list[Row]:
    """Return the rows of tuples that are arrays of numbers or texts."""
    return [Row(name, write=list, read=tuple) for name in names.split()]


def _many(codec: Codec, attribute: str, field: str = "") -> Row:
    """Return the row of a tuple of values that is an array of messages."""
    encode, decode = codec.encode, codec.decode
    return Row(
        attribute,
        field,
        write=lambda values: [encode(each) for each in values],
        read=lambda messages: tuple([decode(each) for each in messages]),
    )


def _zip(keys: Sequence[Any], values: Sequence[Any]) -> Iterable[tuple[Any, Any]]:
    if len(keys) != len(values):
        raise ValueError(f"holds {len(values)} values; allowed: {len(keys)}, one for each key")
    return zip(keys, values)  # noqa: B905  (compared just now)


def _mapping(name: str, keys: str, values: str) -> Row:
    """Return the row of a mapping that is two arrays of one length."""
    return Row(
        name,
        f"{keys} {values}",
        write=lambda known: (list(known), list(known.values())),
        read=lambda keys, values: dict(_zip(keys, values)),
    )


def _pairs(name: str, first: str, second: str, pack: Callable[[Iterable[Any]], Any] = list) -> Row:
    """Return the row of a tuple of pairs that is two arrays of one length."""
    return Row(
        name,
        f"{first} {second}",
        write=lambda pairs: ([one for one, _ in pairs], pack(other for _, other in pairs)),
        read=lambda firsts, seconds: tuple(_zip(firsts, seconds)),
    )


def _stamped(frame: str = "") -> Row:
    """Return the row of a header that is stamped when the message is sent."""
    return Row("", "header", write=lambda: _header(frame), read=None)


def _header(frame: str = "") -> Header:
    return Header(0, genpy.Time(), frame)


POSE = Codec(Pose2D, Pose, "x y yaw=theta")

_MAP = Row(
    "map",
    "map_name map_checksum",
    write=tuple,
    read=MapId,
)

# Tasks.

TASK = Codec(
    bb_msgs.TaskMsg,
    Task,
    "id type priority payload poster no_split",
    _many(POSE, "goals"),
    Row(
        "posted frame",
        "header",
        write=lambda posted, frame: Header(0, genpy.Time.from_sec(posted), frame),
        read=lambda header: (header.stamp.to_sec(), header.frame_id),
    ),
)
"""It decodes any content; the blackboard checks what is posted."""

ORDER = Codec(
    bb_msgs.TaskMsg,
    Order,
    "robot_id step epoch assignment heard hive place",
    _one_of("kind", OrderKind, "order"),
    Within("task", TASK),
)

RECORD = Codec(
    bb_msgs.TaskRecord,
    TaskRecord,
    "robot step eta reason parent assignment step_eta parts earlier predicted_at started ended"
    " division eta_margin",
    Row("task", write=TASK.encode, read=TASK.decode),
    _one_of("state", TaskState),
    *_tuples("tried"),
    kept=RECORDS_KEPT,
)

UPDATE = Codec(
    bb_msgs.TaskState,
    TaskUpdate,
    "task_id robot_id step steps eta epoch reason assignment step_eta put_off_for eta_margin",
    _stamped(),
    _one_of("state", TaskState),
)

GRANT = Codec(bb_msgs.ChargerGrant, Grant, "charger robot=robot_id since there")

LIST = Codec(
    bb_msgs.BbSynch,
    TaskList,
    "epoch version hive earlier",
    _stamped("map"),
    _many(RECORD, "records", "tasks"),
    _many(GRANT, "grants"),
)

# The auction.


def _offer(task: Task, step: int) -> bb_msgs.TaskMsg:
    msg = TASK.encode(task)
    msg.step = step
    return msg


BROADCAST = Codec(
    bb_msgs.TaskMsgArray,
    Broadcast,
    "epoch auction hive round basis",
    _stamped(),
    Row(
        "tasks",
        write=lambda offers: list(starmap(_offer, offers)),
        read=lambda tasks: tuple([(TASK.decode(each), each.step) for each in tasks]),
    ),
    Row(
        "asked",
        "robots given",
        write=lambda asked: (list(asked or ()), list((asked or {}).values())),
        read=lambda robots, given: dict(_zip(robots, given)) if robots else None,
    ),
)

TERMS = Codec(
    bb_msgs.TaskCost,
    CostTerms,
    "energy_charge=energy_cost charge_left place way eta finish waiting added_charge",
)

BID = Codec(
    bb_msgs.TaskCost,
    Bid,
    "robot_id task_id cost energy_cost eta reason under_way most_payload exclusion learned_from"
    " duration formula_duration formula_energy_cost",
    Row(
        "interrupt_cost",
        "interrupt_cost under_way",
        write=None,
        read=lambda cost, under_way: cost if under_way else MAX_COST,
    ),
    Row("interrupt_cost", write=lambda cost: cost, read=None),
    Within("terms", TERMS, present="place"),
)
"""One bid; the array around it knows whose it is and writes the epoch and the header."""

BATTERY = Codec(
    bb_msgs.BidBasis,
    BatteryModel,
    "capacity=battery_capacity voltage_full voltage_empty charging_time",
)

BODY = Codec(
    bb_msgs.BidBasis,
    RobotCharacteristics,
    "mass payload max_speed friction_coefficient radius arm_payload arm_power pick_duration"
    " place_duration idle_power",
    Row(
        "capabilities",
        write=lambda kinds: bytes(sorted(kinds)),
        read=lambda numbers: frozenset(map(TaskType, numbers)),
    ),
    Within("battery", BATTERY),
)

BASIS = Codec(
    bb_msgs.BidBasis,
    BidBasis,
    "charge at_work refusal cost_model aging",
    Row("pose", write=POSE.encode, read=POSE.decode),
    _pairs("tasks", "tasks", "steps", bytes),
    _many(POSE, "chargers"),
    *_tuples("pace"),
    Within("body", BODY),
)


def _write_bids(epoch: int, bids: Iterable[Bid]) -> tuple[Header, list[Any]]:
    header = _header()
    costs = list(map(BID.encode, bids))
    for cost in costs:
        cost.header, cost.epoch = header, epoch
    return header, costs


def _read_bids(robot_id: str, costs: Iterable[Any]) -> tuple[Bid, ...]:
    bids = tuple([BID.decode(cost) for cost in costs])
    if all(bid.robot_id == robot_id for bid in bids):
        return bids
    return tuple(replace(bid, robot_id=robot_id) for bid in bids)


BIDS = Codec(
    bb_msgs.TaskCostArray,
    Bids,
    "robot_id epoch auction round",
    Row("epoch bids", "header costs", write=_write_bids, read=None),
    Row("bids", "robot_id costs", write=None, read=_read_bids),
    Row(
        "basis",
        write=lambda basis: [] if basis is None else [BASIS.encode(basis)],
        read=lambda found: BASIS.decode(found[0]) if found else None,
    ),
)

# Robots.


def _queued(tasks: Sequence[str], now: str) -> int:
    """Return how many tasks wait; what is under way counts only where it is among them."""
    return len(tasks) - (now in tasks)


STATUS = Codec(
    bb_msgs.RobotStatus,
    RobotStatus,
    "robot_id charge payload task_id reason sent hive charger at_charger charger_since",
    _stamped("map"),
    _one_of("state", RobotState),
    Row("pose", write=POSE.encode, read=POSE.decode),
    *_tuples("tasks carries"),
    Row("tasks task_id", "queued", write=_queued, read=None),
    _MAP,
)

# Members.

HEARTBEAT = Codec(
    bb_msgs.BbBackup,
    Heartbeat,
    "epoch leader=active backup progress version sent robot_lease hive patience",
    _stamped(),
    *_tuples("members offline make_room"),
    _mapping("heard", "robots", "heard"),
    _MAP,
)

ENTRY = Codec(
    bb_msgs.BbEntry,
    Entry,
    "epoch version",
    _many(RECORD, "records", "tasks"),
    Row(
        "members",
        "changes_members members",
        write=lambda members: (members is not None, list(members or ())),
        read=lambda changes, members: tuple(members) if changes else None,
    ),
    *_tuples("forgotten"),
    _many(GRANT, "grants"),
)

BEFORE = Codec(bb_msgs.BbEntries, Position, "epoch=before_epoch version=before_version")

SNAPSHOT = Codec(
    bb_msgs.BbEntries,
    Snapshot,
    "earlier",
    Row("", "whole", write=lambda: True, read=None),
    Within("position", BEFORE),
    Row(
        "records",
        "tasks",
        write=lambda records: [RECORD.encode(each) for each in records.values()],
        read=lambda tasks: {record.task.id: record for record in map(RECORD.decode, tasks)},
    ),
    *_tuples("members"),
    Row(
        "grants",
        write=lambda grants: [GRANT.encode(each) for each in grants.values()],
        read=lambda grants: {each.charger: each for each in map(GRANT.decode, grants)},
    ),
)


def _check_versions(sent: AppendEntries) -> None:
    first, versions = sent.before.version + 1, [entry.version for entry in sent.entries]
    if versions != list(range(first, first + len(versions))):
        raise ValueError(
            f"entries {versions} do not follow version {sent.before.version} without a gap"
        )


ENTRIES = Codec(
    bb_msgs.BbEntries,
    AppendEntries,
    "epoch leader=active committed sent hive",
    _stamped(),
    _many(ENTRY, "entries"),
    Within("snapshot", SNAPSHOT, present="whole"),
    Within("before", BEFORE),
    check=_check_versions,
)

REPLY = Codec(
    bb_msgs.BbAck,
    AppendReply,
    "member epoch version echo hive voter=stands_by members promise",
    _stamped(),
)

BALLOT = Codec(
    bb_msgs.BbVote,
    Ballot,
    "epoch candidate member granted seen hive",
    _stamped(),
    _one_of("kind", BallotKind),
    Within("position", Codec(bb_msgs.BbVote, Position, "epoch=list_epoch version=list_version")),
)


# Topics.


class Wire(NamedTuple):
    """The messages of one topic.

    Attributes:
        message: Their class.
        encode: Makes a message from a core value; its header has no stamp of its own yet.
        from_msg: Makes a core value from a message. Raises ValueError, which names the field.
        latched: Whether new subscribers get the last message.
        stamped: Whether the header says when the message was sent.
    """

    message: type
    encode: Callable[[Any], Any]
    from_msg: Callable[[Any], Any]
    latched: bool = False
    stamped: bool = False

    def to_msg(self, value: object, date: float) -> Any:  # noqa: ANN401  (of the type `message`)
        """Return the message of a core value that is sent at a date [s]."""
        msg = self.encode(value)
        if self.stamped:
            msg.header.stamp = genpy.Time.from_sec(date)
        return msg


def _wire(codec: Codec, *, latched: bool = False, stamped: bool = True) -> Wire:
    return Wire(codec.message, codec.encode, codec.decode, latched, stamped)


_TEXT = Wire(String, String, lambda msg: str(msg.data))

WIRES: Mapping[str, Wire] = MappingProxyType(
    {
        topics.NEW_TASK: _wire(TASK, stamped=False),  # it says when the task was posted
        topics.TASK_BROADCAST: _wire(BROADCAST),
        topics.TASK_COST: _wire(BIDS),
        topics.TASK_ASSIGN: _wire(ORDER, stamped=False),
        topics.TASK_STATE: _wire(UPDATE),
        topics.TASK_CANCEL: _TEXT,
        topics.ROBOT_STATUS: _wire(STATUS),
        topics.SYNC: _wire(LIST, latched=True),
        topics.SET_STATE: _TEXT,
        topics.BACKUP: _wire(HEARTBEAT),
        topics.BB_ENTRIES: _wire(ENTRIES),
        topics.BB_ACK: _wire(REPLY),
        topics.BB_VOTE: _wire(BALLOT),
    }
)
"""The messages of every topic of the hive."""
