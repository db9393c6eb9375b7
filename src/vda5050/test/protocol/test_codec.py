# SPDX-License-Identifier: BSD-3-Clause
"""Messages survive the way through JSON, in the words of each version."""

import json

import pytest

from vda5050.errors import MessageError
from vda5050.protocol.actions import (
    Action,
    ActionParameter,
    ActionState,
    ActionStatus,
    BlockingType,
    InstantActions,
)
from vda5050.protocol.codec import MAX_BYTES, decode, encode
from vda5050.protocol.factsheet import (
    ActionScope,
    Factsheet,
    PhysicalParameters,
    ProtocolFeatures,
    RobotAction,
    TypeSpecification,
)
from vda5050.protocol.header import Header, seconds_from, timestamp_of
from vda5050.protocol.order import Deviation, Edge, Node, NodePosition, Order
from vda5050.protocol.state import (
    Connection,
    ConnectionState,
    EmergencyStop,
    Error,
    ErrorLevel,
    Load,
    NodeState,
    OperatingMode,
    Position,
    PowerSupply,
    Reference,
    SafetyState,
    State,
    Visualization,
)
from vda5050.protocol.topics import Topic
from vda5050.protocol.versions import Version

PICK = Action("pick", "a1", BlockingType.HARD, (ActionParameter("loadId", "L7"),))
POSITION = Position(1.0, 2.0, 0.5, "hall", localized=True)
MESSAGES = {
    Topic.ORDER: Order(
        "o1",
        0,
        (
            Node("A", 0, released=True, node_position=NodePosition(1.0, 2.0, "hall")),
            Node(
                "B",
                2,
                released=False,
                actions=(PICK,),
                node_position=NodePosition(
                    3.0, 2.0, "hall", 0.5, allowed_deviation_xy=Deviation(0.4, 0.4)
                ),
            ),
        ),
        (Edge("A-B", 1, released=False, start_node_id="A", end_node_id="B", maximum_speed=1.0),),
    ),
    Topic.INSTANT_ACTIONS: InstantActions((Action("cancelOrder", "c1", BlockingType.NONE),)),
    Topic.STATE: State(
        order_id="o1",
        order_update_id=0,
        last_node_id="A",
        last_node_sequence_id=0,
        driving=True,
        operating_mode=OperatingMode.TEACH_IN,
        power_supply=PowerSupply(80.0, charging=False, battery_voltage=24.1),
        safety_state=SafetyState(EmergencyStop.NONE, field_violation=False),
        node_states=(NodeState("B", 2, released=False),),
        action_states=(ActionState("a1", ActionStatus.WAITING),),
        errors=(Error("blocked", ErrorLevel.WARNING, (Reference("nodeId", "B"),)),),
        mobile_robot_position=POSITION,
        loads=(Load("L1", weight=3.0),),
    ),
    Topic.VISUALIZATION: Visualization(POSITION),
    Topic.CONNECTION: Connection(ConnectionState.CONNECTION_BROKEN),
    Topic.FACTSHEET: Factsheet(
        type_specification=TypeSpecification(
            series_name="C1",
            mobile_robot_kinematics="DIFF",
            mobile_robot_class="CARRIER",
            maximum_load_mass=100.0,
        ),
        physical_parameters=PhysicalParameters(
            maximum_speed=1.5, maximum_acceleration=0.5, width=0.6, length=0.9
        ),
        protocol_features=ProtocolFeatures((RobotAction("pick", (ActionScope.NODE,)),)),
    ),
}


def header(version: Version) -> Header:
    return Header(7, "2026-03-01T10:00:00.250Z", version.text, "acme", "n1")


def content(topic: Topic, version: Version = Version.V2_1) -> dict:
    return json.loads(encode(header(version), MESSAGES[topic], version))


def reason(changed: dict, topic: Topic, version: Version = Version.V2_1) -> str:
    with pytest.raises(MessageError) as caught:
        decode(json.dumps(changed).encode(), topic, version)
    return str(caught.value)


@pytest.mark.parametrize("version", Version)
@pytest.mark.parametrize("topic", Topic)
def test_a_message_that_is_written_and_read_is_the_same(topic, version):
    message = decode(encode(header(version), MESSAGES[topic], version), topic, version)

    assert message.body == MESSAGES[topic]
    assert message.header == header(version)


def test_versions_have_their_own_names_for_the_same_things():
    early, late = content(Topic.STATE, Version.V2_0), content(Topic.STATE, Version.V3_0)

    assert early["agvPosition"]["positionInitialized"] is True
    assert early["batteryState"]["batteryCharge"] == 80.0
    assert early["operatingMode"] == "TEACHIN"
    assert late["mobileRobotPosition"]["localized"] is True
    assert late["powerSupply"]["stateOfCharge"] == 80.0
    assert late["operatingMode"] == "TEACH_IN"
    assert "instantActionStates" not in early


def test_a_deviation_is_a_radius_before_3_0_and_an_ellipse_since():
    early, late = content(Topic.ORDER, Version.V2_1), content(Topic.ORDER, Version.V3_0)

    assert early["nodes"][1]["nodePosition"]["allowedDeviationXY"] == 0.4
    assert late["nodes"][1]["nodePosition"]["allowedDeviationXY"]["a"] == 0.4


def test_unknown_fields_and_null_in_optional_ones_are_passed_over():
    given = content(Topic.STATE) | {"colour": "blue", "paused": None}
    given["agvPosition"]["mood"] = {"good": True}

    assert (
        decode(json.dumps(given).encode(), Topic.STATE, Version.V2_1).body == MESSAGES[Topic.STATE]
    )


@pytest.mark.parametrize(
    ("change", "path"),
    [
        (lambda c: c["nodes"][1].update(sequenceId=-2), "nodes[1].sequenceId: -2"),
        (lambda c: c["nodes"][1].update(released="yes"), "nodes[1].released: 'yes'"),
        (lambda c: c["nodes"][0]["nodePosition"].update(x="1"), "nodes[0].nodePosition.x: '1'"),
        (lambda c: c["nodes"][1]["actions"][0].update(blockingType="HALF"), "blockingType"),
        (lambda c: c.pop("orderId"), "orderId"),
        (lambda c: c["nodes"][0]["nodePosition"].update(x=1e300), "nodes[0].nodePosition.x"),
        (lambda c: c.update(timestamp="yesterday"), "timestamp"),
        (lambda c: c.update(timestamp="2026-13-01T10:00:00Z"), "timestamp"),
    ],
)
def test_a_wrong_field_is_refused_by_its_path(change, path):
    given = content(Topic.ORDER)
    change(given)

    assert path in reason(given, Topic.ORDER)


@pytest.mark.parametrize(
    ("payload", "kind"),
    [
        (b"", "json"),
        (b"\xff\xfe", "json"),
        (b"[" * 100_000, "json"),
        (b'{"headerId": NaN}', "json"),
        (b'{"headerId": ' + b"1" * 5000 + b"}", "json"),
        (b"[]", "schema"),
        (b"{}", "schema"),
        (b" " * (MAX_BYTES + 1), "size"),
    ],
)
def test_what_is_no_message_is_refused(payload, kind):
    with pytest.raises(MessageError) as caught:
        decode(payload, Topic.STATE, Version.V2_1)

    assert caught.value.kind == kind


def test_a_visualization_of_2_x_may_lack_its_header_id():
    given = content(Topic.VISUALIZATION)
    del given["headerId"], given["timestamp"]
    message = decode(json.dumps(given).encode(), Topic.VISUALIZATION, Version.V2_1)

    assert message.header is None
    assert message.body == MESSAGES[Topic.VISUALIZATION]


def test_times_are_read_with_any_fraction_and_zone():
    assert seconds_from("1970-01-01T00:00:01.5Z") == 1.5
    assert seconds_from("1970-01-01T01:00:00.123456789+01:00") == pytest.approx(0.123456789)
    assert timestamp_of(1.25) == "1970-01-01T00:00:01.250Z"
