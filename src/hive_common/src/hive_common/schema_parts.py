# SPDX-License-Identifier: BSD-3-Clause
"""Rules that the JSON schemas of several kinds of file are made of; see `checked_yaml`."""

from __future__ import annotations

from typing import Any

NAME: dict[str, Any] = {
    "type": "string",
    "minLength": 1,
    "description": "a name that is not empty",
}


def positive(what: str, most: float) -> dict[str, Any]:
    """Return the rule for a number above 0, up to `most`; `what` names it with its unit."""
    return {
        "type": "number",
        "exclusiveMinimum": 0,
        "maximum": most,
        "description": f"{what}, above 0 and at most {most:g}",
    }


def section(needed: dict[str, Any], optional: dict[str, Any] | None = None) -> dict[str, Any]:
    """Return the rule for a mapping with the keys `needed`, perhaps the `optional`, no others."""
    return {
        "type": "object",
        "properties": needed | (optional or {}),
        "required": list(needed),
        "additionalProperties": False,
        "description": "the keys " + ", ".join(needed | (optional or {})),
    }


def numbers(count: int, most: float, what: str) -> dict[str, Any]:
    """Return the rule for a list of `count` numbers from `-most` to `most`; `what` names them."""
    return {
        "type": "array",
        "minItems": count,
        "maxItems": count,
        "items": {
            "type": "number",
            "minimum": -most,
            "maximum": most,
            "description": f"a number from {-most:g} to {most:g}",
        },
        "description": what,
    }


def listed(items: dict[str, Any], what: str, least: int = 0) -> dict[str, Any]:
    """Return the rule for a list of at least `least` things; `what` names them."""
    rule = {"type": "array", "items": items, "description": f"a list of {what}"}
    return rule | ({"minItems": least} if least else {})
