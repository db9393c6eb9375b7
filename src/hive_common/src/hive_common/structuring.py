# SPDX-License-Identifier: BSD-3-Clause
"""Turns plain dicts and lists into attrs classes, and names every value that is not allowed.

An attrs class describes what users may write: its fields are the keys, and
`Annotated[float, positive("mass [kg]", 5000)]` adds to a type what is allowed and the words for
it. Rules between fields go into `__attrs_post_init__`, which raises `NotAllowedError`.

A module that defines such classes must not import `annotations` from `__future__`: cattrs drops
`Annotated` from annotations that are strings.

cattrs is imported when something is first read: it costs time and memory, and most programs that
import descriptions read none.
"""

from __future__ import annotations

import re
import sys
from collections import abc
from functools import cache
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, Union, cast, get_args, get_origin

import attrs

from hive_common.errors import HiveError
from hive_common.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from cattrs import Converter

T = TypeVar("T")

MAX_SHOWN = 160  # characters shown of a value that is not allowed


class NotAllowedError(HiveError):
    """A value is not allowed."""

    def __init__(self, place: Iterable[str | int], problem: str) -> None:
        self.place = tuple(place)  # keys and indices that lead to the value, from the outside in
        self.problem = problem  # the value found, what is allowed, and what to do
        super().__init__(f"{key_text(self.place)}: {problem}" if self.place else problem)


@attrs.frozen
class Allowed:
    """What is allowed beyond the type, for use inside `Annotated`."""

    text: str  # ends the sentence "allowed: ..."
    check: Callable[[Any], bool] = bool  # tells whether a value of the right type is allowed


def positive(what: str, most: float) -> Allowed:
    """Allow numbers above 0 and up to `most`; `what` names the value with its unit."""
    return Allowed(f"{what}, above 0 and at most {most:g}", lambda value: 0 < value <= most)


def between(least: float, most: float, what: str) -> Allowed:
    """Allow numbers from `least` to `most`; `what` names the value with its unit."""
    return Allowed(f"{what}, {least:g}..{most:g}", lambda value: least <= value <= most)


def one_of(*values: str | int) -> Allowed:
    """Allow the given values only."""
    return Allowed(" | ".join(map(str, values)), lambda value: value in values)


def each_within(most: float, what: str) -> Allowed:
    """Allow numbers from -`most` to `most`; `what` names the list of them."""
    text = f"{what}, each from {-most:g} to {most:g}"
    return Allowed(text, lambda values: all(abs(value) <= most for value in values))


def listed(what: str, least: int = 0, *, unique: bool = False) -> Allowed:
    """Allow lists of at least `least` items; `what` names the items."""

    def check(items: tuple[Any, ...]) -> bool:
        return len(items) >= least and not (unique and len(set(items)) < len(items))

    return Allowed(f"a list of {what}", check)


Name = Annotated[str, Allowed("a name that is not empty")]


def structure(content: object, kind: type[T]) -> T:
    """Turn plain data into an attrs class; raise NotAllowedError for its first mistake."""
    found, mistakes = structure_all(content, kind)
    if mistakes:
        raise mistakes[0]
    return cast("T", found)  # which may be None, where anything is allowed


def structure_all(content: object, kind: type[T]) -> tuple[T | None, list[NotAllowedError]]:
    """Turn plain data into an instance of an attrs class, or return every mistake in it."""
    from cattrs.errors import BaseValidationError  # noqa: PLC0415  (on demand)

    try:
        return _converter().structure(content, kind), []
    except (BaseValidationError, NotAllowedError) as error:
        return None, list(_mistakes(error, ()))


def key_text(place: Iterable[str | int]) -> str:
    """Return the path to a value as text, such as `robots[2].name`."""
    return "".join(f"[{k}]" if isinstance(k, int) else f".{k}" for k in place).removeprefix(".")


def _refused(value: object, allowed: str) -> NotAllowedError:
    shown = repr(value)
    shown = shown if len(shown) <= MAX_SHOWN else f"{shown[:MAX_SHOWN]}..."
    return NotAllowedError((), f"{shown}; allowed: {allowed}")


def _allowed(kind: Any) -> str:  # noqa: ANN401  (a type, or what stands for one)
    """Return the words for what a type allows."""
    if attrs.has(kind):
        return "the keys " + ", ".join(each.name.rstrip("_") for each in attrs.fields(kind))
    rule = next((arg for arg in get_args(kind) if isinstance(arg, Allowed)), None)
    return rule.text if rule else {Pose: "[x, y, yaw] [m, m, rad]"}.get(kind, "a value")


def _mistakes(error: Exception, place: tuple[str | int, ...]) -> Iterator[NotAllowedError]:
    """Yield the mistakes in what cattrs raised, each with its whole place."""
    from cattrs.errors import (  # noqa: PLC0415  (on demand)
        BaseValidationError,
        ForbiddenExtraKeysError,
    )

    if isinstance(error, NotAllowedError):
        yield NotAllowedError((*place, *error.place), error.problem)
    elif isinstance(error, ForbiddenExtraKeysError):
        for key in sorted(error.extra_fields, key=str):
            yield NotAllowedError((*place, str(key)), f"unknown; allowed: {_allowed(error.cl)}")
    elif isinstance(error, BaseValidationError):
        for each in error.exceptions:
            step = _step(each)
            if isinstance(each, KeyError):
                kind = attrs.fields_dict(error.cl)[str(step[0])].type
                problem = f"missing; allowed: {_allowed(kind)}"
                yield NotAllowedError((*place, str(step[0]).rstrip("_")), problem)
            else:
                yield from _mistakes(each, (*place, *step))
    elif isinstance(error, HiveError):
        yield NotAllowedError(place, str(error))
    else:
        raise error


def _step(error: Exception) -> tuple[str | int, ...]:
    """Return the key or index that cattrs notes on an error inside a class or list."""
    notes = getattr(error, "__notes__", ())
    found = re.search(r"@ (?:attribute (\w+)|index (\d+))$", notes[-1]) if notes else None
    if found is None:
        return ()
    return (found[1].rstrip("_"),) if found[1] else (int(found[2]),)


def _number(value: object, _: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _refused(value, "a number")
    if not abs(value) <= sys.float_info.max:
        raise _refused(value, "a finite number")
    return float(value)


def _whole(value: object, _: object) -> int:
    if isinstance(value, bool) or not (isinstance(value, int | float) and value == value // 1):
        raise _refused(value, "a whole number")
    return int(value)


def _exactly(kind: type, words: str) -> Callable[[object, object], object]:
    def hook(value: object, _: object) -> object:
        if not isinstance(value, kind):
            raise _refused(value, words)
        return value

    return hook


def _tuple(value: object, kind: Any) -> tuple[Any, ...]:  # noqa: ANN401  (a type)
    """Read a list of one type of items, of any length or of as many as the type names."""
    item, *rest = get_args(kind)
    count = None if rest == [...] else len(rest) + 1
    if not isinstance(value, list | tuple) or count not in {None, len(value)}:
        raise _refused(value, f"a list of {count}" if count else "a list")
    return tuple(_converter().structure(value, list[item]))  # type: ignore[valid-type]  # runtime


def _pose(value: object, _: object) -> Pose:
    pose = Pose(*_converter().structure(value, tuple[float, float, float]))
    if pose.flaw:
        raise _refused(value, f"a pose; it {pose.flaw}")
    return pose


def _mapping(value: object, kind: Any) -> dict[Any, Any]:  # noqa: ANN401  (a type)
    """Read keys and values, each of one type."""
    if not isinstance(value, dict):
        raise _refused(value, "keys with values")
    keys, values = get_args(kind)
    found = {}
    for key, part in value.items():
        try:
            found[structure(key, keys)] = structure(part, values)
        except NotAllowedError as error:
            raise NotAllowedError((str(key), *error.place), error.problem) from None
    return found


def _annotated(value: object, kind: Any) -> Any:  # noqa: ANN401  (a type; what it allows)
    base, rule = get_args(kind)
    try:
        found = _converter().structure(value, base)
    except NotAllowedError:
        raise _refused(value, rule.text) from None
    if not rule.check(found):
        raise _refused(value, rule.text)
    return found


def _is_optional(kind: object) -> bool:
    return get_origin(kind) in {Union, UnionType} and type(None) in get_args(kind)


def _optional(value: object, kind: Any) -> Any:  # noqa: ANN401  (a type; what it allows)
    """Read an optional key: it may be left out, but not hold null."""
    return _converter().structure(value, get_args(kind)[0])


def _class(kind: Any) -> Callable[[object, object], Any]:  # noqa: ANN401  (an attrs class)
    """Return what reads an attrs class; a field `from_` stands for the key `from`.

    Unknown keys are mistakes, unless the class has a true attribute `OTHER_KEYS`.
    """
    from cattrs.gen import make_dict_structure_fn, override  # noqa: PLC0415  (on demand)

    names = {each.name: override(rename=each.name.rstrip("_")) for each in attrs.fields(kind)}
    strict = not getattr(kind, "OTHER_KEYS", False)
    build = make_dict_structure_fn(kind, _converter(), _cattrs_forbid_extra_keys=strict, **names)

    def hook(value: object, _: object) -> object:
        if not isinstance(value, dict):
            raise _refused(value, _allowed(kind))
        return build({str(key): part for key, part in value.items()}, kind)

    return hook


@cache
def _converter() -> Converter:
    from cattrs import Converter  # noqa: PLC0415  (on demand)

    made = Converter(detailed_validation=True)
    made.register_structure_hook(float, _number)
    made.register_structure_hook(int, _whole)
    made.register_structure_hook(str, _exactly(str, "a text"))
    made.register_structure_hook(bool, _exactly(bool, "true or false"))
    made.register_structure_hook_func(lambda kind: get_origin(kind) is tuple, _tuple)
    made.register_structure_hook_func(
        lambda kind: get_origin(kind) in {dict, abc.Mapping}, _mapping
    )
    made.register_structure_hook_func(_is_optional, _optional)
    made.register_structure_hook_func(lambda kind: get_origin(kind) is Annotated, _annotated)
    made.register_structure_hook_factory(attrs.has, _class)
    made.register_structure_hook_func(lambda kind: kind is Pose, _pose)
    return made
