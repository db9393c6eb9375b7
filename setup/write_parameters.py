#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes what users read about the parameters from their one source, `domain/settings.py`.

Run `python3 setup/write_parameters.py` after a change there; `test/unit/test_pages.py` checks
that the parameter files and the tables in docs/protocol.md are up to date.
"""

from __future__ import annotations

import re
import sys
import textwrap
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "src" / package / "src") for package in ("hive_common", "blackboard")]

import attrs  # noqa: E402  (below the path)

from blackboard.domain.settings import (  # noqa: E402  (needs the path above)
    BlackboardSettings,
    ControllerSettings,
    PathSettings,
    RaftSettings,
    RobotSettings,
    StartSettings,
    TrafficSettings,
)

MEMBERS = "What follows holds for every member of the hive; robots read it here, too."
FILES = {
    "blackboard": (PathSettings, TrafficSettings, BlackboardSettings, RaftSettings),
    "robot": (StartSettings, PathSettings, RobotSettings, ControllerSettings),
}
"""The parameter files, and the settings that each holds."""

WIDTH = 99
HEAD = "| parameter | default | meaning |"
TABLE = re.compile(rf"^{re.escape(HEAD)}\n(?:\|.*\n)*", re.MULTILINE)
"""A table ends with its last row, whatever follows."""


def shown(value: object) -> str:
    """Return a default as YAML has it."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def meaning(field: attrs.Attribute[object]) -> str:
    """Return what a parameter means, with its unit and what is allowed."""
    about = field.metadata
    unit = f" [{about['unit']}]" if about["unit"] else ""
    return f"{about['text']}{unit}; allowed: {about['allowed']}"


def parameter_file(name: str) -> str:
    """Return the text of a parameter file."""
    comments = [f"The parameters of {name}_node; written by setup/write_parameters.py."]
    blocks = []
    for kind in FILES[name]:
        for number, field in enumerate(attrs.fields(kind)):
            comments += [MEMBERS] * (kind is RaftSettings and number == 0)
            blocks += [_comment(text) for text in comments]
            comments = []
            text = f"{meaning(field)}. {field.metadata['more']}".strip()
            blocks.append(f"{_comment(text)}\n{field.name}: {shown(field.default)}")
    return "\n\n".join(blocks) + "\n"


def with_tables(page: str) -> str:
    """Return docs/protocol.md with its tables of parameters up to date."""
    for name, kinds in FILES.items():
        table = TABLE.search(page, page.index(f"Of `{name}_node`"))
        if table is None:
            raise SystemExit(f"docs/protocol.md: no table of the parameters of {name}_node")
        rows = [
            f"| `{field.name}` | {shown(field.default)} | {meaning(field)} |"
            for kind in kinds
            for field in attrs.fields(kind)
        ]
        lines = [HEAD, "|---|---|---|", *rows, ""]
        page = page[: table.start()] + "\n".join(lines) + page[table.end() :]
    return page


def pages() -> dict[Path, str]:
    """Return what each file should hold."""
    protocol = ROOT / "docs/protocol.md"
    config = ROOT / "src/blackboard/config"
    wanted = {config / f"{name}.yaml": parameter_file(name) for name in FILES}
    return wanted | {protocol: with_tables(protocol.read_text(encoding="utf-8"))}


def _comment(text: str) -> str:
    return textwrap.fill(text, WIDTH, initial_indent="# ", subsequent_indent="# ")


if __name__ == "__main__":
    for path, text in pages().items():
        path.write_text(text, encoding="utf-8")
