# SPDX-License-Identifier: BSD-3-Clause
"""Encodes core values as ROS messages and decodes them again, as a table of fields says.

Members encode and decode thousands of messages a second. A `Codec` therefore turns its table into
the source of functions once, at import, as dataclasses and genpy do; following the table field by
field at every message takes up to twice as long to decode.
"""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import genpy

from blackboard.errors import BlackboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


class FieldError(ValueError):
    """A field of a message holds a value that cannot be decoded.

    Args:
        path: The field, with the fields around it, such as `entries.tasks.state`.
        reason: What is wrong with it, in words for a person.
    """

    def __init__(self, path: str, reason: str) -> None:
        super().__init__(f"{path}: {reason}")
        self.path = path
        self.reason = reason


class Row:
    """Attributes of a core value, and the fields of the message that stand for them.

    Args:
        attributes: Names of the attributes, separated by spaces; may be empty.
        fields: Names of the fields; by default the same.
        write: Takes the attributes and returns the field, or a tuple if there are several. None
            if another row writes the fields.
        read: Takes the fields and returns the attribute, or a tuple if there are several. None if
            another row reads the attributes, or the core does without the fields.
    """

    def __init__(
        self,
        attributes: str,
        fields: str = "",
        *,
        write: Callable[..., Any] | None,
        read: Callable[..., Any] | None,
    ) -> None:
        self.attributes = attributes.split()
        self.fields = (fields or attributes).split()
        self.write = write
        self.read = read


@dataclass(frozen=True)
class Within:
    """An attribute whose own attributes are fields of the same message.

    A field that both the attribute and the value around it write is the latter's.
    """

    attribute: str
    codec: Codec
    present: str = ""  # the field that is false where the attribute is None; empty if it never is


class Codec:
    """Encodes one kind of core value as one type of message, and decodes it.

    Args:
        message: The message class.
        kind: The class of the core value.
        same: Names that attribute and field share; `attribute=field` where they differ.
        rows: Everything that has to be converted.
        check: Takes a decoded value; raises ValueError if its parts contradict each other.
        kept: Number of messages to keep for values that are encoded again; nobody may change
            these messages.

    Attributes:
        message: The message class.
        fields: Names of the fields that are written; the others keep their defaults. A message
            within the message that no row writes is left to the caller.
        encode: Takes a value and returns the message.
        write: Takes a value and a message, and writes the fields into it.
        decode: Takes a message and returns the value. Raises ValueError if the message stands for
            none; the text names the field.
    """

    fields: set[str]
    encode: Callable[[Any], Any]
    write: Callable[[Any, Any], None]
    decode: Callable[[Any], Any]

    def __init__(
        self,
        message: type,
        kind: type,
        same: str,
        *rows: Row | Within,
        check: Callable[[Any], None] | None = None,
        kept: int = 0,
    ) -> None:
        self.message = message
        self._kind = kind
        self._same = [(each.split("=")[0], each.split("=")[-1]) for each in same.split()]
        self._rows = [row for row in rows if isinstance(row, Row)]
        self._within = [row for row in rows if isinstance(row, Within)]
        written = {field for row in self._rows if row.write for field in row.fields}
        written.update(field for _, field in self._same)
        self.fields = written.union(*(row.codec.fields for row in self._within))
        written.update(*(row.codec.fields for row in self._within if not row.present))

        scope: dict[str, Any] = {"message": message, "kind": kind, "check": check}
        scope |= {f"write{i}": row.write for i, row in enumerate(self._rows)}
        scope |= {f"read{i}": row.read for i, row in enumerate(self._rows)}
        scope |= {f"write_{row.attribute}": row.codec.write for row in self._within}
        scope |= {f"read_{row.attribute}": row.codec.decode for row in self._within}
        scope |= {"errors": (BlackboardError, ValueError), "located": self._located}
        scope["new"] = message.__new__
        store, load = self._store_lines(), self._load_lines()
        # The constructor of a message looks at every field twice; this does not call it.
        blank = ["msg = new(message)", *_default_lines(message, written)]
        encode = _compiled("value", [*blank, *store, "return msg"], scope)
        self.encode = lru_cache(kept)(encode) if kept else encode
        self.write = _compiled("value, msg", store, scope)
        checked = ["check(value)"] if check else []
        tried = ["try:", *(f"    {line}" for line in (*load, *checked))]
        caught = ["except errors as error:", "    raise located(msg, error) from None"]
        self.decode = _compiled("msg", [*tried, *caught, "return value"], scope)

    def _store_lines(self) -> list[str]:
        lines = []
        for part in self._within:
            name = part.attribute
            guard = f"if value.{name} is not None: " if part.present else ""
            lines.append(f"{guard}write_{name}(value.{name}, msg)")
        lines += [f"msg.{field} = value.{attribute}" for attribute, field in self._same]
        for i, row in enumerate(self._rows):
            if row.write is not None:
                arguments = _of("value", row.attributes)
                lines.append(f"{_of('msg', row.fields)} = write{i}({arguments})")
        return lines

    def _load_lines(self) -> list[str]:
        lines = []
        found = {attribute: f"msg.{field}" for attribute, field in self._same}
        for i, row in enumerate(self._rows):
            if row.read is not None:
                names = {attribute: f"{attribute}_" for attribute in row.attributes}
                lines.append(f"{', '.join(names.values())} = read{i}({_of('msg', row.fields)})")
                found |= names
        for part in self._within:
            otherwise = f" if msg.{part.present} else None" if part.present else ""
            found[part.attribute] = f"read_{part.attribute}(msg){otherwise}"
        # Arguments by position are faster than by name.
        order = list(inspect.signature(self._kind).parameters)[: len(found)]
        return [*lines, f"value = kind({', '.join(found[name] for name in order)})"]

    def _located(self, msg: Any, error: Exception) -> ValueError:  # noqa: ANN401  (a message)
        """Return an error as one that names the field, if one row alone cannot be read."""
        for row in self._rows:
            try:
                if row.read is not None:
                    row.read(*(getattr(msg, field) for field in row.fields))
            except FieldError as inner:
                return FieldError(f"{row.fields[-1]}.{inner.path}", inner.reason)
            except ValueError as inner:
                return FieldError(row.fields[-1], str(inner))
        return error if isinstance(error, ValueError) else ValueError(str(error))


def _default_lines(message: Any, written: set[str]) -> list[str]:  # noqa: ANN401  (a class that genpy made)
    defaults = {name: getattr(message(), name) for name in message.__slots__}
    return [
        f"msg.{name} = {default!r}"
        for name, default in defaults.items()
        if name not in written and not isinstance(default, genpy.Message)
    ]


def _of(owner: str, names: Sequence[str]) -> str:
    return ", ".join(f"{owner}.{name}" for name in names)


def _compiled(parameters: str, lines: Sequence[str], scope: dict[str, Any]) -> Callable[..., Any]:
    source = "\n    ".join([f"def made({parameters}):", *lines])
    exec(source, scope)  # noqa: S102  (made of names in tables, which are code of this package)
    made: Callable[..., Any] = scope.pop("made")
    return made
