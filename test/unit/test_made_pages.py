# SPDX-License-Identifier: BSD-3-Clause
"""Every picture and page that a program makes has one command, which stands beside it."""

import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "setup" / "pages.py"
PAGES = runpy.run_path(str(SCRIPT))["PAGES"]
MAKER = {file: name for name, made in PAGES.items() for file in made.files}
SHOWN = [
    (page, number, line)
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines())
    if re.match(r" *!\[", line)
]


def test_every_picture_is_made_by_a_word_and_every_file_of_a_word_is_there():
    pictures = {f"docs/images/{path.name}" for path in (ROOT / "docs/images").iterdir()}

    assert pictures - MAKER.keys() == set()
    assert [file for file in MAKER if not (ROOT / file).is_file()] == []
    assert len(MAKER) == sum(len(made.files) for made in PAGES.values())


@pytest.mark.parametrize(
    ("page", "number", "line"), SHOWN, ids=[f"{page.name}-{number}" for page, number, _ in SHOWN]
)
def test_the_command_stands_above_a_picture(page, number, line):
    target = (page.parent / re.search(r"\]\(([^)\s]+)\)", line)[1]).resolve()
    before = page.read_text(encoding="utf-8").splitlines()[number - 1].strip()

    name = MAKER[str(target.relative_to(ROOT))]
    assert before == f"<!-- Made by `python3 setup/pages.py {name}`. -->"


@pytest.mark.parametrize("file", sorted(file for file in MAKER if file.endswith(".md")))
def test_the_command_stands_in_a_page_that_it_makes(file):
    assert f"`python3 setup/pages.py {MAKER[file]}`" in (ROOT / file).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", PAGES)
def test_what_a_word_runs_is_there(name):
    commands = PAGES[name].commands
    modules = re.findall(r"-m (hive_lab[\w.]+)", commands)
    files = re.findall(r"(?<![$\w./])(?:setup|test)/[\w./-]+", commands)

    assert subprocess.run(["bash", "-n", "-c", commands], check=False).returncode == 0
    assert [each for each in files if not (ROOT / each).exists()] == []
    assert [
        module
        for module in modules
        if not (ROOT / "src/hive_lab/src" / f"{module.replace('.', '/')}.py").is_file()
    ] == []


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ([], 0, "  mapping     about 2 min\n"),
        (["mappings"], 2, "pages: 'mappings' is unknown; allowed: allocation, "),
    ],
)
def test_the_command_lists_what_there_is_and_refuses_what_there_is_not(words, code, said):
    ended = subprocess.run(
        [sys.executable, SCRIPT, *words],
        env=os.environ,
        capture_output=True,
        text=True,
        check=False,
    )

    assert ended.returncode == code
    assert said in ended.stdout + ended.stderr
