# SPDX-License-Identifier: BSD-3-Clause
"""JSON schemas of the messages, made from their classes and the table of versions."""

import enum
import inspect
from collections.abc import Iterator
from types import NoneType, UnionType
from typing import Annotated, Any, get_args, get_origin

import attrs

from vda5050.protocol.header import Header
from vda5050.protocol.order import Deviation
from vda5050.protocol.rules import Magnitude, NotNegative, Rule
from vda5050.protocol.versions import (
    CIRCLES,
    HEADER_OPTIONAL,
    Version,
    field_name,
    value_name,
)

Schema = dict[str, Any]

_JSON_TYPES: dict[Any, str] = {str: "string", bool: "boolean", int: "integer", float: "number"}
_LONGEST = 100_000
"""Items of a list; an order has some hundreds."""


def message_schema(kind: type, topic: str, version: Version) -> Schema:
    """Return the schema of a message with its header, as a version of the standard has it.

    Fields that the standard does not name are allowed. An optional field may also be null, since
    many senders write it so.
    """
    body, header = _class(kind, version), _class(Header, version)
    required = header["required"]
    if version in HEADER_OPTIONAL.get(topic, ()):
        required = [name for name in required if name not in {"headerId", "timestamp"}]
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "type": "object",
        "properties": header["properties"] | body["properties"],
        "required": required + body["required"],
    }


def _class(kind: type, version: Version) -> Schema:
    properties, required = {}, []
    for field in attrs.fields(kind):
        name = field_name(kind.__name__, field.name, version)
        if name is None:
            continue
        properties[name] = _of(field.type, version)
        if field.default is attrs.NOTHING or field.metadata.get("required"):
            required.append(name)
    return {"type": "object", "properties": properties, "required": required}


def _of(kind: Any, version: Version) -> Schema:  # noqa: ANN401  (a type, or what stands for one)
    origin, parts = get_origin(kind), get_args(kind)
    if kind is Any:
        return {"type": ["array", "boolean", "number", "string", "object"]}
    if origin is Annotated:
        rules = [part.keywords for part in parts if isinstance(part, Rule)]
        return _of(parts[0], version) | {key: rule[key] for rule in rules for key in rule}
    if origin is UnionType or (origin and NoneType in parts):
        return _or_null(_of(next(part for part in parts if part is not NoneType), version))
    if origin is tuple:
        return {"type": "array", "items": _of(parts[0], version), "maxItems": _LONGEST}
    return _simple(kind, version)


def _simple(kind: type, version: Version) -> Schema:
    if kind is Deviation and version in CIRCLES:
        return {"type": "number"} | NotNegative.keywords
    if attrs.has(kind):
        return _class(kind, version)
    if inspect.isclass(kind) and issubclass(kind, enum.Enum):
        return {"type": "string", "enum": sorted(set(_spellings(kind, version)))}
    return {"type": _JSON_TYPES[kind]} | (Magnitude.keywords if kind is float else {})


def _spellings(kind: type[enum.Enum], version: Version) -> Iterator[str]:
    """Yield how the version writes values; a value that only others have does no harm."""
    for value in kind:
        yield value_name(value, version)
        yield value.value


def _or_null(schema: Schema) -> Schema:
    types = schema["type"]
    types = [*(types if isinstance(types, list) else [types]), "null"]
    choices = {"enum": [*schema["enum"], None]} if "enum" in schema else {}
    return schema | {"type": types} | choices
