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

from robot_description.errors import FileError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path


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
    odd = _not_finite(root)
    if odd is not None:
        line = odd.start_mark.line + 1
        raise FileError(f"{path}:{line}: {odd.value} is no number here; allowed: finite numbers")
    check = jsonschema.Draft202012Validator(schema)
    mistake = jsonschema.exceptions.best_match(check.iter_errors(content))
    if mistake is not None:
        line = _line_of(root, mistake.absolute_path)
        key = mistake.json_path.removeprefix("$").removeprefix(".") or "the whole file"
        allowed = mistake.schema.get("description") if isinstance(mistake.schema, dict) else None
        remedy = f"; allowed: {allowed}" if allowed else ""
        raise FileError(f"{path}:{line}: {key}: {mistake.message}{remedy}")
    return content


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
