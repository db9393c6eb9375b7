# SPDX-License-Identifier: BSD-3-Clause
"""Reads the YAML files that users write, and reports each mistake in one line.

Every kind of file (robot model, fleet, world, map, scenario) is described by an attrs class; see
`structuring`. This module adds the file and the line, which are lost once YAML is parsed.
"""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

import attrs
import yaml

from hive_common.errors import FileError
from hive_common.structuring import NotAllowedError, key_text, structure_all

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

T = TypeVar("T")


def read_checked(path: Path, kind: type[T]) -> T:
    """Read a YAML file into an attrs class.

    Raises:
        FileError: The file cannot be read, is not YAML, or holds something that is not allowed.
            The text names the first mistake.
    """
    found, mistakes = read_all_mistakes(path, kind)
    if found is None:
        raise mistakes[0]
    return found


def read_all_mistakes(path: Path, kind: type[T]) -> tuple[T | None, list[FileError]]:
    """Read a YAML file into an attrs class, or return every mistake in it from the top down.

    Raises:
        FileError: The file cannot be read or is not YAML.
    """
    root, content = _parsed(path)
    found, mistakes = structure_all(content, kind)
    mistakes.sort(key=lambda mistake: _line_of(root, mistake.place))
    return found, [_located(path, root, mistake) for mistake in mistakes]


def unknown_keys(path: Path, kind: type) -> list[str]:
    """Return a line on each key of a file that was read whose attrs class does not know it."""
    root, content = _parsed(path)
    known = [field.name for field in attrs.fields(kind)]
    words = f"unknown, and ignored; known are {', '.join(known)}"
    return [
        f"{path}:{_line_of(root, [key])}: {key}: {words}"
        for key in map(str, content)
        if key not in known
    ]


def error_at(path: Path, place: Iterable[str | int], problem: str) -> FileError:
    """Return the error for a mistake that only shows after `read_checked`, in the same words.

    `place` are the keys and indices that lead to it: `("robots", 2, "name")`; `problem` is the
    value found, what is allowed, and what to do.
    """
    root = yaml.compose(path.read_text(encoding="utf-8"), Loader=yaml.SafeLoader)
    return _located(path, root, NotAllowedError(place, problem))


@contextmanager
def named_at(path: Path, *place: str | int) -> Iterator[None]:
    """Say of errors in another file where the file that names it does so; see `error_at`."""
    try:
        yield
    except FileError as error:
        raise error_at(path, place, str(error)) from None


def _located(path: Path, root: yaml.Node | None, mistake: NotAllowedError) -> FileError:
    key = key_text(mistake.place) or "the whole file"
    return FileError(f"{path}:{_line_of(root, mistake.place)}: {key}: {mistake.problem}")


def _parsed(path: Path) -> tuple[yaml.Node, Any]:
    """Return a YAML file as nodes, which know their lines, and as plain data."""
    try:
        text = path.read_text(encoding="utf-8")
        root = yaml.compose(text, Loader=yaml.SafeLoader)
        content = yaml.safe_load(text)
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}; check the name") from None
    except UnicodeDecodeError:
        raise FileError(f"{path}: is not a text file; a YAML file in UTF-8 is needed") from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f":{mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or "cannot be parsed"
        raise FileError(f"{path}{where}: is not YAML: {problem}") from None
    if content is None:
        raise FileError(f"{path}: is empty; see a file that comes with the package")
    try:
        flaw = next(_flaws(root), None)
    except RecursionError:
        raise FileError(
            f"{path}: an alias (*) is inside its own anchor (&); write it out"
        ) from None
    if flaw is not None:
        node, problem = flaw
        raise FileError(f"{path}:{node.start_mark.line + 1}: {problem}")
    return root, content


def _flaws(node: yaml.Node) -> Iterator[tuple[yaml.Node, str]]:
    """Yield what plain data no longer shows: repeated keys, of which YAML keeps the last one.

    Numbers that are not finite are named here too, as they are written in the file.
    """
    if isinstance(node, yaml.ScalarNode):
        is_float = node.tag == "tag:yaml.org,2002:float"
        if is_float and node.value.lower().strip("+-") in {".nan", ".inf"}:
            yield node, f"{node.value} is not a number; allowed: finite numbers"
    elif isinstance(node, yaml.MappingNode):
        seen: set[str] = set()
        for key, value in node.value:
            if str(key.value) in seen:
                yield key, f"the key {key.value} appears twice; keep one of them"
            seen.add(str(key.value))
            yield from _flaws(key)
            yield from _flaws(value)
    else:
        for item in node.value:
            yield from _flaws(item)


def _line_of(node: yaml.Node | None, place: Iterable[str | int]) -> int:
    """Return the line, counted from 1, of a place, or of what should hold it."""
    line: int = node.start_mark.line + 1 if node else 1
    for key in place:
        if isinstance(node, yaml.SequenceNode):
            node = node.value[int(key)]
            line = node.start_mark.line + 1
        elif isinstance(node, yaml.MappingNode):
            named = next((pair for pair in node.value if pair[0].value == str(key)), None)
            if named is None:
                break
            line, node = named[0].start_mark.line + 1, named[1]
    return line
