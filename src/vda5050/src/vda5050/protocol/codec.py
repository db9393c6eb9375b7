# SPDX-License-Identifier: BSD-3-Clause
"""Turns messages into JSON and back, in the words of one version of the standard."""

from __future__ import annotations

import enum
import json
from functools import cache
from typing import TYPE_CHECKING, Any

import attrs
import fastjsonschema
from cattrs import Converter
from cattrs.gen import make_dict_structure_fn, make_dict_unstructure_fn, override

from vda5050.errors import MessageError
from vda5050.protocol.actions import ActionParameter, InstantActions
from vda5050.protocol.factsheet import Factsheet
from vda5050.protocol.header import Header, seconds_from
from vda5050.protocol.order import Deviation, Order
from vda5050.protocol.schema import message_schema
from vda5050.protocol.state import Connection, State, Visualization
from vda5050.protocol.topics import Topic
from vda5050.protocol.versions import CIRCLES, Version, field_name, value_name

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

MAX_BYTES = 1_000_000
"""Of a message; the longest that AGVs send have some 100 kB."""

_OTHER_NAME = "instantActions"
"""What 1.1, and many who speak 2.0, call the field `actions` of instant actions."""

_SHOWN = 160  # characters of a refusal's reason

KINDS: dict[Topic, type] = {
    Topic.ORDER: Order,
    Topic.INSTANT_ACTIONS: InstantActions,
    Topic.STATE: State,
    Topic.VISUALIZATION: Visualization,
    Topic.CONNECTION: Connection,
    Topic.FACTSHEET: Factsheet,
}
Body = Order | InstantActions | State | Visualization | Connection | Factsheet


@attrs.frozen
class Message:
    """A message that was read."""

    header: Header | None
    """None where the version lets it be missing and it is."""
    body: Body


def encode(header: Header, body: Body, version: Version) -> bytes:
    """Return a message as JSON, in the names of a version; what the version lacks is left out."""
    content = _converter(version).unstructure(header) | _converter(version).unstructure(body)
    if isinstance(body, InstantActions) and version is Version.V2_0:
        content[_OTHER_NAME] = content["actions"]
    return json.dumps(content, allow_nan=False, separators=(",", ":")).encode()


def decode(payload: bytes, topic: Topic, version: Version) -> Message:
    """Read a message; fields that the standard does not name are passed over.

    Raises:
        MessageError: The message is too long, is no JSON or not what the standard allows.
    """
    content = _parse(payload)
    if topic is Topic.INSTANT_ACTIONS and version is Version.V2_0 and _OTHER_NAME in content:
        content.setdefault("actions", content[_OTHER_NAME])
    try:
        _validator(topic, version)(content)
    except fastjsonschema.JsonSchemaValueException as error:
        raise MessageError("schema", _sentence(error)) from None
    converter = _converter(version)
    header = None
    if isinstance(content.get("headerId"), int | float) and content.get("timestamp"):
        header = converter.structure(content, Header)
        try:
            seconds_from(header.timestamp)
        except ValueError as error:
            raise MessageError("schema", f"timestamp: {error}") from None
    body: Body = converter.structure(content, KINDS[topic])
    return Message(header, body)


def prepare(version: Version, topics: Iterable[Topic]) -> None:
    """Get ready for reading topics; the first message of each would take longer otherwise."""
    for topic in topics:
        _validator(topic, version)


def _parse(payload: bytes) -> dict[str, Any]:
    if len(payload) > MAX_BYTES:
        text = f"{len(payload)} bytes; allowed: at most {MAX_BYTES}"
        raise MessageError("size", text)
    try:
        content = json.loads(payload, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise MessageError("json", f"no JSON: {str(error)[:_SHOWN]}") from None
    if not isinstance(content, dict):
        raise MessageError("schema", f"{type(content).__name__}; allowed: a JSON object")
    return content


def _refuse_constant(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


def _sentence(error: fastjsonschema.JsonSchemaValueException) -> str:
    """Return what is wrong as: the path, the value found, what is allowed."""
    path = str(error.name).removeprefix("data.").removeprefix("data") or "the message"
    rule = error.message.removeprefix(str(error.name)).strip()
    found = "" if error.rule == "required" else f" {error.value!r:.60}"
    return f"{path}:{found} {rule}"[: 2 * _SHOWN]


@cache
def _validator(topic: Topic, version: Version) -> Callable[[Any], Any]:
    schema = message_schema(KINDS[topic], topic.value, version)
    return fastjsonschema.compile(schema)  # type: ignore[no-any-return]  # it has no types


@cache
def _converter(version: Version) -> Converter:
    """Return what translates between values and the JSON of a version.

    It checks nothing: what it reads has been checked by the schema.
    """
    made = Converter(detailed_validation=False)

    def names(kind: type) -> dict[str, Any]:
        return {
            field.name: override(rename=name, omit_if_default=field.default is None)
            if (name := field_name(kind.__name__, field.name, version))
            else override(omit=True)
            for field in attrs.fields(kind)
        }

    made.register_structure_hook_factory(
        attrs.has,
        lambda kind: make_dict_structure_fn(
            kind, made, _cattrs_detailed_validation=False, **names(kind)
        ),
    )
    made.register_unstructure_hook_factory(
        attrs.has, lambda kind: make_dict_unstructure_fn(kind, made, **names(kind))
    )
    made.register_structure_hook(
        ActionParameter, lambda given, _: ActionParameter(given["key"], given["value"])
    )
    made.register_unstructure_hook(
        ActionParameter, lambda given: {"key": given.key, "value": given.value}
    )
    if version in CIRCLES:
        made.register_structure_hook(Deviation, lambda radius, _: Deviation(radius, radius))
        made.register_unstructure_hook(Deviation, lambda given: min(given.a, given.b))
    made.register_unstructure_hook(enum.Enum, lambda value: value_name(value, version))
    made.register_structure_hook(enum.Enum, lambda text, kind: _values(kind, version)[text])
    return made


@cache
def _values(kind: type[enum.Enum], version: Version) -> dict[str, enum.Enum]:
    """Return what the texts of an enumeration mean; those of other versions are understood."""
    return {value_name(value, version): value for value in kind} | {
        value.value: value for value in kind
    }
