# SPDX-License-Identifier: BSD-3-Clause
"""Messages that are kept as they came, and read only where somebody wants to know.

What an operator posts reaches every member, and only the active one does something with it. rospy
would read each message for each of them, which is most of what hearing it costs.
"""

from __future__ import annotations

import functools
from typing import Any


@functools.cache
def unread(kind: type) -> type:
    """Return a class that rospy takes for a message class, whose messages hold bytes.

    Its `read` makes the message of them; it raises genpy.DeserializationError where it cannot.

    Args:
        kind: The message class.
    """

    class Unread(kind):  # type: ignore[misc]  # genpy classes are not typed
        __slots__ = ("_data",)

        def __init__(self) -> None:
            """Leave all fields out, which the constructor of the message class would fill."""

        def deserialize(self, data: bytes) -> Any:  # noqa: ANN401  (itself, as genpy's does)
            self._data = data
            return self

        def read(self) -> Any:  # noqa: ANN401  (a message of the class)
            return kind().deserialize(self._data)

    return Unread
