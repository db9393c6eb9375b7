# SPDX-License-Identifier: BSD-3-Clause
"""What the standard allows beyond a type, as keywords of JSON schema for use in `Annotated`."""

from __future__ import annotations

import math
from typing import Any

import attrs


class Rule:
    """Keywords of JSON schema that are added to those of the type."""

    def __init__(self, **keywords: object) -> None:
        self.keywords = keywords


UInt32 = Rule(minimum=0, maximum=2**32 - 1)
Text = Rule(minLength=1, maxLength=256)
"""Names and ids; the standard sets no limit, but nobody's ids are longer."""
Angle = Rule(minimum=-math.pi - 1e-3, maximum=math.pi + 1e-3)
"""[rad]; senders round pi in either direction."""
NotNegative = Rule(minimum=0, maximum=1e9)
Share = Rule(minimum=0, maximum=1)
Percent = Rule(minimum=0, maximum=100)
Magnitude = Rule(minimum=-1e9, maximum=1e9)
"""Of any number: no coordinate or speed is larger, and what is not a number fails it."""


def each() -> Any:  # noqa: ANN401  (attrs types its fields by what stands on their left)
    """Return a list that the standard wants in every message, even if it is empty."""
    return attrs.field(default=(), metadata={"required": True})
