# SPDX-License-Identifier: BSD-3-Clause
"""Changes single fields of valid ROS messages into odd values of the same type.

A message of random values is refused for its first bad field, so nothing behind that check is
tested. A valid message with one odd field passes all checks but one, or all of them.
"""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import genpy

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from random import Random

_MANY = 10_001
"""Items of a list that is longer than any of a hive may be."""

_RARELY = 0.02
"""Share of the changed lists that become so long; decoding them takes a while."""

_INTS = {
    **{f"uint{bits}": (0, 2**bits - 1) for bits in (8, 16, 32, 64)},
    **{f"int{bits}": (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) for bits in (8, 16, 32, 64)},
}

_FLOATS = (
    *(math.nan, math.inf, -math.inf, 1e308, -1e308, 3.5e38, 5e-324, -0.0),
    *(1e13, 1e12, 1e5, -1.0, 0.0, 1.0),
)

_LARGEST = 3.4e38  # that a float32 can hold

_TEXTS = (
    *("", "x" * 65, "x" * 257, "x" * 20_000, "\x00", "a b", "\n\x1b[31m", "/", "..", "../.."),
    *("odom", "robot1/map", "Zürich", "\N{PILE OF POO}", "#", "blackboard#0"),
)

_TIMES = (
    *(genpy.Time(), genpy.Time(0, 1), genpy.Time(1), genpy.Time(2**31 - 1, 999_999_999)),
    *(genpy.Time(2**32 - 1), genpy.Time(2**32 - 1, 999_999_999)),
)


@dataclass(frozen=True)
class _Leaf:
    """One field of a message, or one item of a list in it."""

    path: str
    kind: str
    value: Any
    put: Callable[[Any], None]


class Mutations:
    """Changes messages.

    Args:
        random: Draws what is changed, and into what.
        names: Names that mean something in the hive: of robots, members and tasks.
    """

    def __init__(self, random: Random, names: Sequence[str] = ()) -> None:
        self._random = random
        self.names = names

    def mutate(self, data: bytes, kind: type[genpy.Message]) -> tuple[genpy.Message, str]:
        """Return a changed copy of a message as it arrives, and what was changed.

        Args:
            data: The message as bytes.
            kind: Its class.
        """
        message = kind().deserialize(data)
        changes = []
        for _ in range(self._random.choice((1, 1, 1, 1, 2, 3))):
            leaf = self._random.choice(list(_leaves(message, "")))
            odd = self._odd(leaf.kind, leaf.value)
            leaf.put(odd)
            changes.append(f"{leaf.path} = {odd!r:.80}")
        return kind().deserialize(as_bytes(message)), ", ".join(changes)

    def _odd(self, kind: str, value: Any) -> Any:  # noqa: ANN401  (a field's)
        draw = self._random
        if kind.endswith("]"):
            return self._odd_list(value)
        if kind.startswith("float"):
            odd = (*_FLOATS, value * 1.0000001, -value, value + 1.0)
            most = math.inf if kind == "float64" else _LARGEST
            return draw.choice([number for number in odd if not most < abs(number) < math.inf])
        if kind in _INTS:
            least, most = _INTS[kind]
            near = (max(least, value - 1), min(most, value + 1))
            lowest = (least,) if least < 0 else ()
            return draw.choice((*lowest, 0, 1, 2, most, most - 1, most // 2 + 1, *near))
        if kind == "string":
            return draw.choice((*_TEXTS, *self.names, *self.names, f"{value} ", f"{value}#1"))
        if kind == "bool":
            return not value
        if kind == "time":
            return draw.choice((*_TIMES, genpy.Time(value.secs // 2)))
        raise TypeError(f"fields of type {kind} cannot be changed yet; add some odd values")

    def _odd_list(self, value: Any) -> Any:  # noqa: ANN401  (a list, or bytes)
        items = list(value)
        odd = [[], items * 2, items[::-1], items[:-1], items[1:]]
        if items and self._random.random() < _RARELY:
            odd = [items[:1] * _MANY]
        chosen = self._random.choice(odd)
        return bytes(chosen) if isinstance(value, bytes) else chosen


def as_bytes(message: genpy.Message) -> bytes:
    """Return a message as it goes over a connection.

    Raises:
        genpy.SerializationError: A field holds what its type does not allow.
    """
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def _leaves(message: genpy.Message, path: str) -> Iterator[_Leaf]:
    """Return every field of a message that can be changed, with those of messages in it."""
    for slot, kind in zip(message.__slots__, message._slot_types, strict=True):  # noqa: SLF001  (genpy's name for them)
        value = getattr(message, slot)
        if isinstance(value, tuple):  # genpy's for lists of numbers
            value = list(value)
            setattr(message, slot, value)

        def put(odd: Any, slot: str = slot) -> None:  # noqa: ANN401  (a field's)
            setattr(message, slot, odd)

        where = f"{path}{slot}"
        if isinstance(value, genpy.Message):
            yield from _leaves(value, f"{where}.")
            continue
        yield _Leaf(where, kind, value, put)
        if kind.endswith("]") and not isinstance(value, bytes):
            yield from _items(value, kind.partition("[")[0], where)


def _items(items: list[Any], kind: str, path: str) -> Iterator[_Leaf]:
    for index, item in enumerate(items):
        if isinstance(item, genpy.Message):
            yield from _leaves(item, f"{path}[{index}].")
        else:

            def put(odd: Any, index: int = index) -> None:  # noqa: ANN401  (an item's)
                items[index] = odd

            yield _Leaf(f"{path}[{index}]", kind, item, put)
