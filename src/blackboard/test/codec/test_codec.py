# SPDX-License-Identifier: BSD-3-Clause
"""Every field of every message, encoded from a core value and decoded again."""

import inspect
import io
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("blackboard.msg", reason="needs generated messages: ./hive test unit")

import blackboard.msg as bb_msgs

from blackboard.codec import tables
from blackboard.codec.tables import WIRES
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

HERE, THERE = Pose(1.0, 2.0, 3.0), Pose(4.0, 5.0, 6.0)
TASK = Task("T1", TaskType.GPAB, (HERE, THERE), 7, 2.5, "map", 12.25, "desk 3", no_split=True)
RECORD = TaskRecord(
    *(TASK, TaskState.STARTED, "robot1", 1, 8.0, "slow", "T0", 5, ("robot2",), 3.0, 2, 4),
    *(9.5, 1.5, 2.5, "split", 1.25),
)
TERMS = CostTerms(0.5, 7.0, 2, 11.0, 13.0, 17.0, 19.0, 0.25)
BID = Bid(
    *("robot1", "T1", 300.0, 0.5, 13.0, "far", "T2", 20.0, 4.0),
    terms=TERMS,
    exclusion="payload",
    learned_from=34,
    duration=6.0,
    formula_duration=8.0,
    formula_energy_cost=0.75,
)
BODY = RobotCharacteristics(
    *(30.0, 20.0, 1.5, 0.02, 0.3, BatteryModel(10.0, 25.0, 20.0, 3600.0)),
    frozenset({TaskType.GAB, TaskType.GPA}),
    *(2.0, 40.0, 5.0, 6.0, 7.0),
)
BASIS = BidBasis(
    *(BODY, "latency", 60.0, HERE, 0.7, True, "it charges"),
    tasks=(("T1", 1), ("T2", 3)),
    chargers=(HERE, THERE),
    pace=(2.0, 1.4, 0.6),
)
GRANT = Grant("dock", "robot1", 7.5, there=True)
ENTRY = Entry(3, 9, (RECORD,), ("robot1#1", "robot2#1"), ("T7",), (GRANT,))
SNAPSHOT = Snapshot(Position(2, 8), {"T1": RECORD}, ("robot1#1",), 6, {"dock": GRANT})

FULL = {
    "POSE": HERE,
    "TASK": TASK,
    "ORDER": Order(TASK, "robot1", OrderKind.HAND_BACK_UNBEGUN, 1, 2, 3, 4.5, "hive", 6),
    "RECORD": RECORD,
    "UPDATE": TaskUpdate(
        *("T1", TaskState.STARTED, "robot1", 1, 2, 3.5, 4, "slow", 5, 6.5),
        put_off_for="T9",
        eta_margin=1.25,
    ),
    "GRANT": GRANT,
    "LIST": TaskList(2, 3, (RECORD,), "hive", earlier=4, grants=(GRANT,)),
    "BROADCAST": Broadcast(
        *(2, 3, ((TASK, 1), (TASK, 2)), "hive", 4, {"robot1": "", "robot2": "T7"}),
        basis=True,
    ),
    "BID": BID,
    "BASIS": BASIS,
    "BIDS": Bids("robot1", 2, 3, (BID, replace(BID, task_id="T5")), 4, BASIS),
    "STATUS": RobotStatus(
        *("robot1", RobotState.BUSY, HERE, 0.7, 2.5, "T1", "blocked"),
        tasks=("T1", "T2", "T3"),
        sent=4.5,
        hive="hive",
        carries=(20.0, 20.0, -1.0, 0.5),
        map=MapId("hall", "0a1b2c3d"),
        charger="dock",
        at_charger=True,
        charger_since=8.5,
    ),
    "HEARTBEAT": Heartbeat(
        *(2, "robot1", "robot2", ("robot1", "robot2"), 3, 4, 5.5, {"robot3": 6.5}, 7.5, "hive"),
        offline=("robot4",),
        make_room=("robot5",),
        patience=0.75,
        map=MapId("lab", "3d2c1b0a"),
    ),
    "ENTRY": ENTRY,
    "ENTRIES": AppendEntries(
        3, "robot1#1", Position(2, 8), (ENTRY,), 5, 6.5, SNAPSHOT, "hive", to=()
    ),
    "REPLY": AppendReply("robot1#1", 2, 3, 4.5, "hive", voter=True, members=6, promise=0.5),
    "BALLOT": Ballot(BallotKind.VOTE, 2, "robot1#1", "robot2#1", Position(3, 4), True, 5, "hive"),
}
"""For each table a value that differs from the defaults in every field of its message."""

RENAMED = {
    "POSE": {"x": 1.0, "y": 2.0, "theta": 3.0},
    "BID": {"energy_cost": 0.5, "eta": 13.0},
    "BASIS": {"battery_capacity": 10.0, "tasks": ["T1", "T2"], "steps": b"\x01\x03"},
    "BROADCAST": {"robots": ["robot1", "robot2"], "given": ["", "T7"]},
    "STATUS": {
        "queued": 2,
        "map_name": "hall",
        "map_checksum": "0a1b2c3d",
    },
    "GRANT": {"robot_id": "robot1"},
    "HEARTBEAT": {
        "active": "robot1",
        "robots": ["robot3"],
        "heard": (6.5,),
        "map_name": "lab",
        "map_checksum": "3d2c1b0a",
    },
    "ENTRIES": {"active": "robot1#1", "before_epoch": 2, "before_version": 8, "whole": True},
    "REPLY": {"stands_by": True},
    "BALLOT": {"list_epoch": 3, "list_version": 4},
}
"""Fields that are not called like their attribute; swapping two would survive a round trip."""

BY_THE_ARRAY = {"epoch"}
"""Fields of a TaskCost that the array around it writes."""

OTHERS = {
    **{
        f"an order of the kind {kind.name}": ("ORDER", Order(TASK, "robot1", kind, assignment=3))
        for kind in OrderKind
    },
    "a call for bids to all": ("BROADCAST", Broadcast(2, 3, ((TASK, 0),))),
    "bids instead of a basis": ("BIDS", Bids("robot1", 2, 3, (BID,))),
    "a bid without terms": ("BID", Bid("robot1", "T5", MAX_COST, reason="heavy")),
    "a change that keeps the members": ("ENTRY", Entry(3, 9, (RECORD,))),
    "a change that leaves no member": ("ENTRY", Entry(3, 9, members=())),
    "entries without a snapshot": (
        "ENTRIES",
        AppendEntries(3, "robot1#1", Position(2, 8), (ENTRY,), 5, 6.5),
    ),
    "an answer of a learner": ("REPLY", AppendReply("robot1#1", 2, 3, 4.5, voter=False)),
}


def sent(codec, value):
    """Return a value's message as it arrives at another node."""
    msg, buffer = codec.encode(value), io.BytesIO()
    if msg.__slots__[0] == "header" and not hasattr(msg, "header"):
        msg.header, msg.epoch = bb_msgs.TaskCost().header, 0  # the array around it does this
    msg.serialize(buffer)
    return codec.message().deserialize(buffer.getvalue())


@pytest.mark.parametrize("name", FULL)
def test_a_value_with_nothing_left_at_its_default_is_decoded_as_it_was_encoded(name):
    codec, value = getattr(tables, name), FULL[name]

    assert codec.decode(sent(codec, value)) == value


@pytest.mark.parametrize("name", OTHERS)
def test_a_value_that_leaves_something_out_is_decoded_as_it_was_encoded(name):
    table, value = OTHERS[name]
    codec = getattr(tables, table)

    assert codec.decode(sent(codec, value)) == value


@pytest.mark.parametrize("name", FULL)
def test_every_field_that_a_table_writes_carries_what_the_value_says(name):
    codec = getattr(tables, name)
    msg, blank = sent(codec, FULL[name]), codec.message()
    fields = codec.fields - {"header"}

    assert {field for field in fields if getattr(msg, field) == getattr(blank, field)} == set()


@pytest.mark.parametrize("name", RENAMED)
def test_a_field_of_another_name_carries_its_attribute(name):
    msg = sent(getattr(tables, name), FULL[name])

    assert {field: getattr(msg, field) for field in RENAMED[name]} == RENAMED[name]


@pytest.mark.parametrize("name", FULL)
def test_every_attribute_of_the_values_above_differs_from_its_default(name):
    value = FULL[name]
    defaults = {
        each.name: each.default
        for each in inspect.signature(type(value)).parameters.values()
        if each.default is not each.empty
    }
    alike = {each for each, default in defaults.items() if getattr(value, each) == default}

    # A reply that is not a voter's is in OTHERS; `to` is not told in a message.
    assert alike - {"to", "voter"} == set()


@pytest.mark.parametrize(
    "message", sorted({getattr(tables, name).message for name in FULL}, key=str)
)
def test_the_tables_of_a_message_write_all_its_fields(message):
    codecs = [getattr(tables, each) for each in FULL]
    written = set().union(*(each.fields for each in codecs if each.message is message))
    written |= BY_THE_ARRAY if message is bb_msgs.TaskCost else set()

    assert set(message.__slots__) - {"header"} == written - {"header"}


def test_every_message_of_the_package_has_a_table():
    known = {getattr(tables, name).message for name in FULL}
    files = (Path(__file__).parents[2] / "msg").glob("*.msg")

    assert {getattr(bb_msgs, file.stem) for file in files} - known == set()


def test_every_topic_has_a_message():
    names = {
        each for name, each in vars(topics).items() if name.isupper() and isinstance(each, str)
    }

    assert set(WIRES) == names
    assert all(wire.encode and wire.from_msg and wire.message for wire in WIRES.values())


STAMPED = sorted(
    set(WIRES) - {topics.NEW_TASK, topics.TASK_ASSIGN, topics.TASK_CANCEL, topics.SET_STATE}
)


def value_for(topic):
    """Return a value that is sent on a topic."""
    encoders = {getattr(tables, name).encode: value for name, value in FULL.items()}
    return encoders[WIRES[topic].encode]


@pytest.mark.parametrize("topic", STAMPED)
def test_a_message_is_stamped_with_the_date_at_which_it_is_sent(topic):
    msg = WIRES[topic].to_msg(value_for(topic), 12.5)

    assert msg.header.stamp.to_sec() == 12.5


def test_all_bids_of_an_answer_have_its_stamp():
    msg = WIRES[topics.TASK_COST].to_msg(FULL["BIDS"], 12.5)

    assert {cost.header.stamp.to_sec() for cost in msg.costs} == {12.5}


@pytest.mark.parametrize(
    ("topic", "task"), [(topics.NEW_TASK, "TASK"), (topics.TASK_ASSIGN, "ORDER")]
)
def test_the_stamp_of_a_task_says_when_it_was_posted(topic, task):
    value = FULL[task]
    posted = getattr(value, "task", value).posted

    assert WIRES[topic].to_msg(value, posted + 60.0).header.stamp.to_sec() == pytest.approx(posted)


def test_bids_carry_the_epoch_the_stamp_and_the_robot_of_their_array():
    msg = tables.BIDS.encode(FULL["BIDS"])
    cost = msg.costs[1]
    assert (cost.epoch, cost.header, cost.robot_id) == (2, msg.header, "robot1")

    cost.robot_id = "robot9"
    assert {bid.robot_id for bid in tables.BIDS.decode(msg).bids} == {"robot1"}


def test_a_record_is_encoded_once():
    assert tables.RECORD.encode(RECORD) is tables.RECORD.encode(replace(RECORD))


def changed(name, **fields):
    """Return the message of a full value with other fields."""
    msg = sent(getattr(tables, name), FULL[name])
    for field, value in fields.items():
        setattr(msg, field, value)
    return msg


WRONG = {
    "state": ("UPDATE", {"state": 9}, r"^state: 9 is unknown; allowed: 0 to 6$"),
    "kind": ("BALLOT", {"kind": 4}, r"^kind: 4 is unknown; allowed: 0 to 3$"),
    "order": ("ORDER", {"order": 5}, r"^order: 5 is unknown; allowed: 0 to 4$"),
    "heard": ("HEARTBEAT", {"heard": []}, r"^heard: holds 0 values; allowed: 1, one for each"),
    "given": ("BROADCAST", {"given": ["T7"]}, r"^given: holds 1 values; allowed: 2"),
    "capabilities": ("BASIS", {"capabilities": b"\x09"}, r"^capabilities: 9 is "),
    "mass": ("BASIS", {"mass": -1.0}, r"mass is -1.0; allowed: above 0"),
    "capacity": ("BASIS", {"battery_capacity": 0.0}, r"battery: capacity is 0.0; allowed"),
    "gap": ("ENTRIES", {"before_version": 7}, r"entries \[9\] do not follow version 7"),
}


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_value_is_refused_with_its_field_and_what_is_allowed(what):
    name, fields, text = WRONG[what]

    with pytest.raises(ValueError, match=text):
        getattr(tables, name).decode(changed(name, **fields))


def test_a_status_whose_task_is_not_on_its_list_can_be_told_again():
    # The leader tells the last status of a robot that has fallen silent.
    told = sent(tables.STATUS, replace(FULL["STATUS"], task_id="T9", tasks=()))

    assert told.queued == 0


def test_a_wrong_value_deep_in_a_message_is_named_with_all_fields_around_it():
    msg = changed("ENTRIES")
    msg.entries[0].tasks[0].state = 77

    with pytest.raises(ValueError, match=r"^entries\.tasks\.state: 77 is unknown"):
        tables.ENTRIES.decode(msg)
