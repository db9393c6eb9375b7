# SPDX-License-Identifier: BSD-3-Clause
"""Reads the YAML files that users write, and says in one line what is wrong with a bad one.

Every kind of file (robot model, fleet, world, map, scenario) has a JSON schema next to the code
that reads it. The schema checks the file; this module only adds where in the file the mistake is,
which `jsonschema` cannot know because YAML has thrown the line numbers away by then.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import jsonschema
import yaml

from hive_common.errors import FileError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

LONGEST = 160
"""So many characters are shown of what a schema says about a value."""


def read_checked(path: Path, schema: Mapping[str, Any]) -> Any:  # noqa: ANN401  (what YAML holds)
    """Read a YAML file that must fit a schema.

    Args:
        path: The file.
        schema: JSON schema, draft 2020-12. A `description` beside a rule is shown to the user as
            what is allowed there, so write it as the end of the sentence "allowed: ...".

    Returns:
        What the file holds, as plain dicts, lists, strings and numbers.

    Raises:
        FileError: The file is missing or unreadable, is no YAML, or does not fit the schema.
    """
    root, content = _parsed(path)
    check = jsonschema.Draft202012Validator(schema)
    mistake = jsonschema.exceptions.best_match(check.iter_errors(content))
    if mistake is not None:
        raise _in_words(path, root, mistake)
    return content


def read_all_mistakes(path: Path, schema: Mapping[str, Any]) -> tuple[Any, list[FileError]]:
    """Read a YAML file like `read_checked`, but do not stop at the first mistake.

    Args:
        path: The file.
        schema: As for `read_checked`.

    Returns:
        What the file holds, and everything that does not fit the schema, from the top down.

    Raises:
        FileError: The file is missing or unreadable, or is no YAML.
    """
    root, content = _parsed(path)
    found = list(jsonschema.Draft202012Validator(schema).iter_errors(content))
    # Something with an unknown key has none of several forms either; one line says it.
    odd = {tuple(each.absolute_path) for each in found if each.validator == "additionalProperties"}
    found = [
        each for each in found if each.validator != "oneOf" or tuple(each.absolute_path) not in odd
    ]
    ordered = sorted(found, key=lambda mistake: _line_of(root, _place_of(mistake)))
    return content, [_in_words(path, root, mistake) for mistake in ordered]


def _parsed(path: Path) -> tuple[yaml.Node | None, Any]:
    """Return a YAML file as nodes, which know their lines, and as what it holds."""
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
        twice, odd = _said_twice(root), _not_finite(root)
    except RecursionError:
        raise FileError(
            f"{path}: an alias (*) is inside its own anchor (&); write it out"
        ) from None
    if twice is not None:
        line = twice.start_mark.line + 1
        raise FileError(f"{path}:{line}: the key {twice.value} is there twice; keep one of them")
    if odd is not None:
        line = odd.start_mark.line + 1
        raise FileError(f"{path}:{line}: {odd.value} is no number here; allowed: finite numbers")
    return root, content


def _in_words(
    path: Path, root: yaml.Node | None, mistake: jsonschema.exceptions.ValidationError
) -> FileError:
    line = _line_of(root, _place_of(mistake))
    key = mistake.json_path.removeprefix("$").removeprefix(".") or "the whole file"
    allowed = mistake.schema.get("description") if isinstance(mistake.schema, dict) else None
    remedy = f"; allowed: {allowed}" if allowed else ""
    return FileError(f"{path}:{line}: {key}: {_short(mistake.message)}{remedy}")


def _place_of(mistake: jsonschema.exceptions.ValidationError) -> tuple[str | int, ...]:
    """Return where a mistake is: for a key that is not known, at the key itself."""
    place = tuple(mistake.absolute_path)
    if mistake.validator == "additionalProperties":
        unknown = [key for key in mistake.instance if key not in mistake.schema["properties"]]
        return (*place, unknown[0])
    return place


def _short(message: str) -> str:
    """Return what a schema says of a value, without most of a long value."""
    return message if len(message) <= LONGEST else f"{message[:LONGEST]}..."


def error_at(path: Path, keys: Iterable[str | int], problem: str) -> FileError:
    """Make the error for a mistake that a schema cannot see, in the words of `read_checked`.

    Args:
        path: The file, already read once by `read_checked`.
        keys: Where in it the mistake is, from the outside in: `("robots", 2, "name")`.
        problem: The value found, what is allowed, and what to do.

    Returns:
        The error, to be raised by the caller.
    """
    keys = tuple(keys)
    root = yaml.compose(path.read_text(encoding="utf-8"), Loader=yaml.SafeLoader)
    key = "".join(f"[{k}]" if isinstance(k, int) else f".{k}" for k in keys).removeprefix(".")
    return FileError(f"{path}:{_line_of(root, keys)}: {key}: {problem}")


def _said_twice(node: yaml.Node | None) -> yaml.Node | None:
    """Return the first key that a mapping has already, of which YAML keeps the last, or None."""
    children: list[yaml.Node] = []
    if isinstance(node, yaml.MappingNode):
        seen: set[str] = set()
        for key, value in node.value:
            if str(key.value) in seen:
                return key
            seen.add(str(key.value))
            children.append(value)
    elif isinstance(node, yaml.SequenceNode):
        children = node.value
    return next((key for key in map(_said_twice, children) if key is not None), None)


def _not_finite(node: yaml.Node | None) -> yaml.Node | None:
    """Return the first `.nan` or `.inf`, which a JSON schema lets through, or None."""
    if isinstance(node, yaml.ScalarNode):
        is_float = node.tag == "tag:yaml.org,2002:float"
        return node if is_float and node.value.lower().strip("+-") in {".nan", ".inf"} else None
    if isinstance(node, yaml.MappingNode):
        children = [part for pair in node.value for part in pair]
    else:
        children = node.value if node is not None else []
    return next((odd for odd in map(_not_finite, children) if odd is not None), None)


def _line_of(node: yaml.Node | None, keys: Iterable[str | int]) -> int:
    """Return the line on which the value under `keys` starts, counted from 1."""
    if node is None:
        return 1
    line: int = node.start_mark.line + 1
    for key in keys:
        if isinstance(node, yaml.SequenceNode):
            node = node.value[key]
            line = node.start_mark.line + 1
        elif isinstance(node, yaml.MappingNode):
            named, node = next(pair for pair in node.value if pair[0].value == str(key))
            line = named.start_mark.line + 1
    return line
