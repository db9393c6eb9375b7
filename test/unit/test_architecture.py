# SPDX-License-Identifier: BSD-3-Clause
"""docs/architecture.md shows the code as it is: its picture of imports, and the places it names.

`python3 test/unit/test_architecture.py` draws the picture anew.
"""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

grimp = pytest.importorskip("grimp", reason="grimp comes with import-linter; ./hive setup")

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "architecture.md"
PACKAGES = sorted(
    path.name for path in (ROOT / "src").iterdir() if (path / "package.xml").exists()
)
# It ends at a line that closes the fence, and never reaches beyond the next heading.
PICTURE = re.compile(
    r"(?<=<!-- drawn from the imports -->\n```mermaid\n)(?:(?!```|#).*\n)*(?=```\n)"
)
PLACE = re.compile(r"`(src/[\w/.]+\.py)(?:::([\w.]+))?`")


def room_of(module):
    """Return the box that a module is drawn in, or None where it is left out.

    A box is a folder, a module at the root of a package that has folders, or a package that has
    none besides its shell. Errors and helpers of tests are left out: every folder uses them.
    """
    package, *inner = module.split(".")
    if package == "hive_lab" or not inner or inner[-1] in {"errors", "testing"}:
        return None
    if package in {"hive_common", "robot_description"}:
        return f"{package}.ros" if inner[0] == "ros" else f"{package}.core"
    return f"{package}.{inner[0]}"


def arrows(graph):
    """Return which box imports which, without those that follow from others."""
    direct = {}
    for module in graph.modules:
        room = room_of(module)
        if room is not None:
            others = map(room_of, graph.find_modules_directly_imported_by(module))
            direct.setdefault(room, set()).update(other for other in others if other)
            direct[room].discard(room)

    def reach(name):
        return direct[name].union(*map(reach, direct[name]))

    return direct, sorted(
        (name, other)
        for name, others in direct.items()
        for other in others
        if not any(other in reach(between) for between in others - {other})
    )


def picture():
    """Return the mermaid text: a box for each package, an arrow for each import that counts."""
    for package in PACKAGES:
        sys.path.insert(0, str(ROOT / "src" / package / "src"))
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    del sys.path[: len(PACKAGES)]
    rooms, imports = arrows(graph)
    lines = ["flowchart TD"]
    for package in PACKAGES:
        inside = sorted(room for room in rooms if room.startswith(f"{package}."))
        if inside:
            names = [f"    {room.replace('.', '_')}[{room.partition('.')[2]}]" for room in inside]
            lines += [f"  subgraph {package}", *names, "  end"]
    lines += [f"  {a.replace('.', '_')} --> {b.replace('.', '_')}" for a, b in imports]
    return "\n".join(lines) + "\n"


def definitions(path):
    """Return the dotted names of the classes, functions and methods of a file."""
    names = set()

    def visit(node, prefix):
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.ClassDef | ast.FunctionDef):
                names.add(prefix + child.name)
                visit(child, f"{prefix}{child.name}.")

    visit(ast.parse(path.read_text(encoding="utf-8")), "")
    return names


def test_the_picture_is_drawn_from_the_imports():
    drawn = PICTURE.search(PAGE.read_text(encoding="utf-8"))
    # In an interpreter of its own: this one may have loaded catkin's relays to the packages.
    command = [sys.executable, __file__, "--print"]
    environment = os.environ | {"PYTHONPATH": ""}
    now = subprocess.run(
        command, env=environment, capture_output=True, text=True, check=True
    ).stdout

    assert drawn, "the picture has lost its mark, or the line of ``` that ends it"
    assert drawn[0] == now, "renew it: python3 test/unit/test_architecture.py"


@pytest.mark.parametrize(
    ("file", "name"),
    sorted(set(PLACE.findall(PAGE.read_text(encoding="utf-8")))),
    ids=lambda part: part.rpartition("/")[2],
)
def test_a_place_that_the_page_names_is_there(file, name):
    assert (ROOT / file).is_file()
    assert not name or name in definitions(ROOT / file)


def test_the_walk_of_a_task_names_a_function_in_every_step():
    walk = PAGE.read_text(encoding="utf-8").partition("## One task")[2].partition("\n## ")[0]
    steps = re.findall(r"^\d+\. (.*)", walk, re.MULTILINE)

    assert len(steps) >= 10
    assert [step for step in steps if not any(name for _, name in PLACE.findall(step))] == []


if __name__ == "__main__" and "--print" in sys.argv:
    sys.stdout.write(picture())
elif __name__ == "__main__":
    page, found = PICTURE.subn(lambda _: picture(), PAGE.read_text(encoding="utf-8"), count=1)
    if not found:
        sys.exit(f"{PAGE}: the picture has lost its mark, or the line of ``` that ends it")
    PAGE.write_text(page, encoding="utf-8")
