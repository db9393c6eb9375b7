# SPDX-License-Identifier: BSD-3-Clause
"""Every link of a page leads somewhere, and every decision page that the code names exists."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LISTED = subprocess.run(
    ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
    cwd=ROOT,
    capture_output=True,
    text=True,
    check=True,
).stdout.split()
# A page below test/ is a template; what is made of it lies in docs/.
PAGES = sorted(
    name
    for name in LISTED
    if name.endswith(".md") and not name.startswith("test/") and (ROOT / name).is_file()
)
DECISIONS = {path.name[:3] for path in (ROOT / "docs/decisions").glob("*.md")}


def anchors(page):
    """Return the anchors that GitHub makes of the headings of a page."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    kept = (re.sub(r"[^\w\- ]", "", heading.strip().lower()) for heading in headings)
    return {words.replace(" ", "-") for words in kept}


@pytest.mark.parametrize("name", PAGES)
def test_every_link_of_a_page_leads_somewhere(name):
    page = ROOT / name
    links = re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8"))
    broken = []
    for link in links:
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        if "://" in link or link.startswith("mailto:"):
            continue
        is_page = target.suffix == ".md" and target.is_file()
        if not target.exists() or (anchor and is_page and anchor not in anchors(target)):
            broken.append(link)

    assert broken == []


def test_every_decision_page_that_is_named_exists():
    named = {
        (name, number)
        for name in LISTED
        if name.endswith((".py", ".md", ".msg", ".toml", ".bash", ".launch", ".yaml"))
        and (ROOT / name).is_file()
        for number in re.findall(
            r"decisions?[ /](\d{3})\b", (ROOT / name).read_text(encoding="utf-8")
        )
    }

    assert {each for each in named if each[1] not in DECISIONS} == set()


def test_a_decision_takes_one_page_and_there_are_few():
    longest = {
        path.name: len(path.read_text().splitlines()) for path in ROOT.glob("docs/decisions/*.md")
    }

    assert len(longest) <= 30
    assert max(longest.values()) <= 40
