# SPDX-License-Identifier: BSD-3-Clause
"""Reads a node's private parameters once, and checks each where it is read."""

from __future__ import annotations

import dataclasses
import sys
from typing import TYPE_CHECKING, Any, TypeVar

import rospy

from hive_common.errors import HiveError, ParameterError
from hive_common.structuring import NotAllowedError, structure

if TYPE_CHECKING:
    from collections.abc import Iterable

Settings = TypeVar("Settings")

_KINDS = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}


def below(namespace: str) -> dict[str, Any]:
    """Return the parameters below a namespace by name; none where it has none.

    Raises:
        ParameterError: It is itself a parameter.
    """
    found = rospy.get_param(namespace, {})
    if not isinstance(found, dict):
        raise ParameterError(f"{namespace} is {found!r:.80}; allowed: parameters below it")
    return found


def read(kind: type[Settings], namespace: str = "", shared: str = "") -> Settings:
    """Read the parameters that a class of settings has fields for.

    A field's default is the parameter's default and sets its type.

    Args:
        kind: The class, made by dataclasses or attrs; its errors are HiveErrors.
        namespace: Where the parameters are; by default this node's name.
        shared: Where those are that hold for several nodes; they take the place of empty texts.

    Raises:
        ParameterError: A value has the wrong type or is not allowed; the text names it.
    """
    prefix = f"{namespace or rospy.get_name()}/"
    # One call: the master answers one at a time, and all nodes ask while a system starts.
    given = below(prefix.rstrip("/"))
    instead = below(shared) if shared and "" in given.values() else {}
    values = {}
    for name, default in _defaults(kind).items():
        value = given.get(name, default)
        is_left_open = value == "" != default
        value = instead.get(name, default) if is_left_open else value
        values[name] = _typed(prefix + name, value, type(default))
    try:
        return kind(**values)
    except HiveError as error:
        raise ParameterError(f"{prefix}{error}") from None


def refuse_unknown(kinds: Iterable[type], others: Iterable[str] = (), node: str = "") -> None:
    """Refuse private parameters that nothing reads; most likely they are typos.

    Args:
        kinds: The classes of settings that this node reads.
        others: Names of the other private parameters that it reads.
        node: The node's full name; by default this process's.

    Raises:
        ParameterError: There is one; the text names it and those that exist.
    """
    known = sorted({name for kind in kinds for name in _defaults(kind)} | set(others))
    node = node or rospy.get_name()
    for name in below(node):
        if name not in known:
            allowed = ", ".join(known)
            raise ParameterError(f"{node}/{name} is unknown; allowed: {allowed}")


def structured(name: str, kind: type[Settings], default: object) -> Settings:
    """Return a parameter that holds a list or keys, as a value that has checked itself.

    Args:
        name: Its name, relative to the namespace, or private.
        kind: What it is read as; see `structuring`.
        default: What is read where it is not set.

    Raises:
        ParameterError: It holds something that is not allowed; the text names it.
    """
    try:
        return structure(rospy.get_param(name, default), kind)
    except NotAllowedError as error:
        raise ParameterError(f"{rospy.resolve_name(name)}: {error}") from None


def text(name: str, default: str | None = None) -> str:
    """Return a private parameter that is a text; without a default it must be set."""
    value = str(rospy.get_param(f"~{name}", "" if default is None else default))
    if not value:
        raise ParameterError(f"parameter ~{name} is missing; give it as _{name}:=...")
    return value


def flag(name: str, *, default: bool, node: str = "") -> bool:
    """Return a private parameter, of this node or another, that is true or false."""
    full = f"{node or rospy.get_name()}/{name}"
    return bool(_typed(full, rospy.get_param(full, default), bool))


def number(
    name: str, *, least: float, most: float, default: float | None = None, node: str = ""
) -> float:
    """Return a private parameter, of this node or another, that is a number.

    Without a default it must be set.
    """
    full = f"{node}/{name}" if node else f"~{name}"
    value = rospy.get_param(full, default)
    if value is None:
        raise ParameterError(f"parameter ~{name} is missing; give it as _{name}:=...")
    good = isinstance(value, int | float) and not isinstance(value, bool)
    if not (good and least <= value <= most):
        raise ParameterError(
            f"parameter {full}: {value!r:.80}; allowed: a number from {least:g} to {most:g}"
        )
    return float(value)


def whole_number(name: str, *, least: int, most: int, default: int) -> int:
    """Return a private parameter that is a whole number."""
    value = number(name, least=least, most=most, default=default)
    if value != int(value):
        raise ParameterError(f"parameter ~{name}: {value}; allowed: a whole number")
    return int(value)


def _defaults(kind: Any) -> dict[str, Any]:  # noqa: ANN401  (a class made by dataclasses or attrs)
    fields = getattr(kind, "__attrs_attrs__", None) or dataclasses.fields(kind)
    return {field.name: field.default for field in fields}


def _typed(name: str, value: Any, wanted: type) -> Any:  # noqa: ANN401  (what a parameter holds)
    if wanted is float and type(value) is int and abs(value) <= sys.float_info.max:
        return float(value)
    if type(value) is not wanted:
        raise ParameterError(f"{name} is {value!r:.80}; allowed: {_KINDS[wanted]}")
    return value
