# SPDX-License-Identifier: BSD-3-Clause
"""Writes one HTML file that needs no other: tables, pictures and texts."""

from __future__ import annotations

import base64
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

_PAGE = """\
<!doctype html>
<html lang="en">
<meta charset="utf-8">
<title>{title}</title>
<style>
body {{ font-family: sans-serif; margin: 2em; color: #222 }}
table {{ border-collapse: collapse }}
th, td {{ border: 1px solid #ccc; padding: 0.3em 0.7em; text-align: right }}
th:first-child, td:first-child {{ text-align: left }}
tr.marked td {{ font-weight: bold; background: #fff3d6 }}
img {{ max-width: 100%; margin: 1em 0 }}
pre {{ background: #f4f4f4; padding: 1em; overflow-x: auto }}
</style>
<h1>{title}</h1>
<p>{facts}</p>
{sections}
</html>
"""


def page(title: str, facts: str, sections: Iterable[str]) -> str:
    """Return a page.

    Args:
        title: The heading.
        facts: What there is to know about all of it, in a sentence.
        sections: What `heading`, `table`, `picture` and `listing` have made.
    """
    return _PAGE.format(title=escape(title), facts=escape(facts), sections="\n".join(sections))


def heading(text: str) -> str:
    """Return the heading of a section."""
    return f"<h2>{escape(text)}</h2>"


def table(
    head: Sequence[str], rows: Iterable[Sequence[str]], marked: frozenset[int] = frozenset()
) -> str:
    """Return a table; the rows whose numbers are `marked`, from 0, stand out."""
    lines = ["<tr>" + "".join(f"<th>{escape(cell)}</th>" for cell in head) + "</tr>"]
    for number, row in enumerate(rows):
        mark = ' class="marked"' if number in marked else ""
        lines.append(f"<tr{mark}>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>")
    return "<table>\n" + "\n".join(lines) + "\n</table>"


def picture(text: str, file: Path) -> str:
    """Return a PNG file, which becomes a part of the page, with a text for who cannot see it."""
    data = base64.b64encode(file.read_bytes()).decode()
    return f'<img alt="{escape(text)}" src="data:image/png;base64,{data}">'


def listing(text: str, title: str = "") -> str:
    """Return a text as it stands, below a title."""
    above = f"<h3>{escape(title)}</h3>\n" if title else ""
    return f"{above}<pre>{escape(text)}</pre>"
