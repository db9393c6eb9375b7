# SPDX-License-Identifier: BSD-3-Clause
"""Every page is whole: its fences are closed, and nothing has run into a diagram.

A generator that misses the end of its block swallows what follows, and the page still looks like
Markdown. Here that is a fault of the page, and of the generator that could do it.
"""

import re
import runpy
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted(
    name
    for name in subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.md"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    if (ROOT / name).is_file()
)
FENCE = re.compile(r" *(`{3,}|~{3,}) *([^`\s]*)")
HEADING = re.compile(r"#{1,6} \S")
DIAGRAM = re.compile(
    r"(?:flowchart|graph) (?:TB|TD|BT|RL|LR)\b"
    r"|(?:sequence|class|state|er)Diagram(?:-v2)?\b|gantt\b|timeline\b"
)


def faults_of(text):
    """Return what is wrong with the fences of a page, each with the number of its line."""
    faults, opened, inside = [], None, []
    lines = ["", *text.splitlines()]
    for number, line in enumerate(lines[1:], 1):
        fence = FENCE.match(line)
        if opened is None:
            if fence:
                opened, inside = (number, fence[1], fence[2]), []
                before = lines[number - 1].strip()
                if before and not before.startswith("<!--"):
                    faults.append(f"{number}: no blank line before the fence")
        elif fence and fence[1].startswith(opened[1]):
            if fence[2]:
                faults.append(f"{opened[0]}: not closed before the fence in line {number}")
                opened, inside = (number, fence[1], fence[2]), []
                continue
            if opened[2] == "mermaid":
                faults += diagram_faults(opened[0], inside)
            if lines[number + 1 : number + 2] not in ([], [""]):
                faults.append(f"{number}: no blank line after the fence")
            opened = None
        else:
            inside.append((number, line))
    return faults + ([f"{opened[0]}: not closed before the end"] if opened else [])


def diagram_faults(start, lines):
    """Return what is wrong with the lines of a diagram, whose fence opens in line `start`."""
    begins = [number for number, line in lines if DIAGRAM.match(line.strip())]
    faults = [f"{n}: a heading in a diagram" for n, line in lines if HEADING.match(line)]
    if begins[:1] != [start + 1]:
        faults.append(f"{start}: the first line names no kind of diagram")
    return faults + [f"{number}: a second diagram in a diagram" for number in begins[1:]]


@pytest.mark.parametrize("name", PAGES)
def test_every_fence_of_a_page_is_closed_and_holds_one_thing(name):
    assert faults_of((ROOT / name).read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("a\n\n```mermaid\nflowchart TD\n  a --> b\n```\n\nb\n", []),
        ("<!-- made -->\n```\n# a remark of a shell\n```\n", []),
        ("````\n```mermaid\n````\n", []),
        ("```\na\n", ["1: not closed before the end"]),
        (
            "```mermaid\nflowchart TD\n  a --> b\n```mermaid\nflowchart LR\n  a --> b\n```\n",
            ["1: not closed before the fence in line 4"],
        ),
        ("a\n```\nb\n```\n", ["2: no blank line before the fence"]),
        ("```\nb\n```\na\n", ["3: no blank line after the fence"]),
        ("```mermaid\nflowchart TD\n## Next\n```\n", ["3: a heading in a diagram"]),
        ("```mermaid\n  a --> b\n```\n", ["1: the first line names no kind of diagram"]),
        (
            "```mermaid\nflowchart TD\n  a --> b\nflowchart LR\n  a --> b\n```\n",
            ["4: a second diagram in a diagram"],
        ),
    ],
)
def test_a_page_that_is_not_whole_is_noticed(text, faults):
    assert faults_of(text) == faults


def test_the_picture_of_the_imports_reaches_no_further_than_its_fence():
    pytest.importorskip("grimp", reason="grimp comes with import-linter; ./hive setup")
    picture = runpy.run_path(str(ROOT / "test/unit/test_architecture.py"))["PICTURE"]
    page = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    end = picture.search(page).end()
    following = page[end:].removeprefix("```\n")

    assert picture.sub("", page, count=1) == page[: picture.search(page).start()] + page[end:]
    assert not picture.search(page[:end] + following), "a fence that is lost is not the next one"


def test_a_table_of_parameters_reaches_no_further_than_its_rows():
    script = runpy.run_path(str(ROOT / "setup/write_parameters.py"))
    page = (ROOT / "docs/protocol.md").read_text(encoding="utf-8")
    head = script["HEAD"]
    start = page.index(head)
    end = page.index("\n\n", start)
    crowded = page[:end] + "\nA line that follows at once.\n" + page[end:]

    assert script["with_tables"](crowded) == script["with_tables"](page).replace(
        page[start:end], page[start:end] + "\nA line that follows at once.\n"
    )
