# SPDX-License-Identifier: BSD-3-Clause
"""Reads docs/your-site.md: its files, and its commands in their order.

The fast commands run in `test/unit/test_your_site.py`, all of them in `your_site.py`.
"""

import re
import shlex
from pathlib import Path

PAGE = Path(__file__).resolve().parents[3] / "docs" / "your-site.md"
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(kind):
    """Return the code blocks of the page that are of a kind: `yaml`, or empty for commands."""
    text = PAGE.read_text(encoding="utf-8")
    return [content for found, content in BLOCK.findall(text) if found == kind]


def save_files(folder):
    """Save the files of the page below a folder, each under the name in its first line."""
    for content in blocks("yaml"):
        name = re.match(r"# (\S+): ", content)[1]
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(content, encoding="utf-8")


def commands():
    """Return the commands of the page, each as its words."""
    return [shlex.split(line) for block in blocks("") for line in block.splitlines()]
