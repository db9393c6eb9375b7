# SPDX-License-Identifier: BSD-3-Clause
"""What the pages tell users to type exists: words, options, launch files, arguments and nodes.

Nothing is run, and files of the user's own need not exist.
"""

import re
import shlex
import xml.etree.ElementTree as ET
from pathlib import Path

import click
import pytest

from fleet_manager.cli.context import FileName
from fleet_manager.cli.main import hive
from hive_common.resources import is_path, names_in

ROOT = Path(__file__).resolve().parents[2]
PAST = {"benchmarks-history.md"}
"""It may name what is gone."""
PAGES = [
    ROOT / "README.md",
    *sorted(page for page in (ROOT / "docs").glob("*.md") if page.name not in PAST),
]
BLOCK = re.compile(r"^ *```[^\n]*\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`([^`\n]+)`")
PROMPT = re.compile(r"^(?:\$ |nice |[A-Z_]+=\S+ )+")
FRONT = {
    "setup": {""},
    "test": {"", "unit", "hive", "rostest", "gui", "quick"},
    "shell": {"", "-c"},
    "help": {""},
}
"""The words of `./hive` that bash handles itself, and what may follow."""
PLACEHOLDERS = {"...", "FILE", "FOLDER", "MODEL", "N", "NAME", "TASK", "WORD"}
"""What stands for a name, a number or a file of the user's own."""


class NoSuchThingError(Exception):
    """A page names something that does not exist."""


def written(page):
    """Return what a page tells to type: the lines of its code blocks, and commands in its text."""
    text = page.read_text(encoding="utf-8")
    lines = [line for block in BLOCK.findall(text) for line in block.splitlines()]
    lines += INLINE.findall(BLOCK.sub("", text))
    commands = (PROMPT.sub("", line.strip()) for line in lines)
    return [each for each in commands if re.match(r"(?:(?:\./)?hive|roslaunch|rosrun) \S", each)]


def check(line):
    """Raise NoSuchThingError if a line names what does not exist."""
    program, *words = shlex.split(line.rstrip("&"), comments=True)
    {"roslaunch": check_launch, "rosrun": check_node}.get(program, check_hive)(words)


def check_hive(words):
    """Check the words behind `./hive`."""
    name = words[0]
    if name in FRONT:
        following = words[1] if words[1:] and "/" not in words[1] else ""
        demand(following, FRONT[name], f"hive {name}")
    elif name == "bench":
        module = pytest.importorskip("hive_lab.bench.command", reason="needs the workspace")
        check_command(module.bench, words[1:])
    elif name == "compare":
        module = pytest.importorskip("hive_lab.compare.command", reason="needs the workspace")
        check_command(module.compare, words[1:])
    elif name not in PLACEHOLDERS and not name.startswith("--"):
        check_command(hive, words)


def check_command(command, words):
    """Check words for a command of click: its subcommands, options, and their values."""
    context = click.Context(command, info_name=command.name)
    try:
        values, others, _ = command.make_parser(context).parse_args(list(words))
        for option in command.get_params(context):
            for value in flattened(values.get(option.name)):
                check_value(option.type, value, option, context)
    except click.ClickException as error:
        raise NoSuchThingError(f"{command.name}: {error.format_message()}") from None
    if not isinstance(command, click.Group):
        demand("".join(others), {""}, f"{command.name}: further words")
    elif others:
        demand(others[0], set(command.list_commands(context)), f"{command.name}: words")
        check_command(command.get_command(context, others[0]), others[1:])


def flattened(value):
    """Return the words of a value that click's parser has found."""
    if isinstance(value, (list, tuple)):
        return [word for each in value for word in flattened(each)]
    return [value] if isinstance(value, str) and value else []


def check_value(kind, value, option, context):
    """Check one value of an option or argument; files of users need not exist."""
    if value in PLACEHOLDERS or isinstance(kind, click.Path):
        return
    if isinstance(kind, FileName):
        if not is_path(value):
            demand(value, set(names_in(*kind.found_in)), f"names of {kind.found_in[1]}")
        return
    kind.convert(value, option, context)


def check_launch(words):
    """Check the words behind `roslaunch`: the file, its arguments, and that none is missing."""
    given = [word for word in words if not word.startswith("-")]
    if given[0] in PLACEHOLDERS:
        return
    package, file, *arguments = given
    path = ROOT / "src" / package / "launch" / file
    if not path.parents[1].is_dir():
        return  # another project's
    demand(file, {each.name for each in path.parent.glob("*.launch")}, f"launch files: {package}")
    tags = ET.parse(path).getroot().findall("arg")  # noqa: S314  (our own file)
    known = {tag.get("name"): tag for tag in tags if tag.get("value") is None}
    names = {word.partition(":=")[0] for word in arguments}
    for name in names:
        demand(name, set(known), f"arguments of {file}")
    if arguments:
        required = {name for name, tag in known.items() if tag.get("default") is None}
        demand("".join(sorted(required - names)), {""}, f"{file}: required and missing")


def check_node(words):
    """Check the words behind `rosrun`: the node, and its options."""
    package, node, *arguments = words
    folder = ROOT / "src" / package / "nodes"
    if not folder.parent.is_dir():
        return  # another project's
    demand(node, {each.name for each in folder.iterdir()}, f"nodes of {package}")
    options = [word for word in arguments if word.startswith("--")]
    module = re.search(r"^from ([\w.]+) import", (folder / node).read_text(), re.MULTILINE)
    source = ROOT / "src" / package / "src" / f"{module[1].replace('.', '/')}.py"
    known = set(re.findall(r'"(--[\w-]+)"', source.read_text(encoding="utf-8")))
    for option in options:
        demand(option.partition("=")[0], known, f"options of {node}")


def demand(name, known, what):
    """Raise NoSuchThingError unless a name is one of those known."""
    if name not in known:
        raise NoSuchThingError(f"{name!r}; {what}: {', '.join(sorted(known))}")


COMMANDS = [(page, line) for page in PAGES for line in dict.fromkeys(written(page))]


@pytest.mark.parametrize(
    "line",
    [line for _, line in COMMANDS],
    ids=[f"{page.stem}: {line}" for page, line in COMMANDS],
)
def test_what_a_page_tells_to_type_exists(line):
    check(line)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("./hive jobs", "'jobs'; hive: words: "),
        ("./hive test units", "'units'; hive test: "),
        ("./hive add GA --gaol 3,4", "add: No such option: --gaol"),
        ("./hive add GX --goal 3,4", "add: Invalid value for 'TYPE': 'GX' is not one of"),
        (
            "./hive add GA --priority 11",
            "add: Invalid value for '--priority': 11 is",
        ),
        ("./hive add GA --goal 3,x", "add: Invalid value for '--goal': '3,x' is not a goal"),
        ("hive run nothing", "'nothing'; names of scenarios: "),
        ("hive robots robot1", "'robot1'; robots: further words: "),
        ("hive fault sleep robot1", "'sleep'; fault: words: "),
        ("roslaunch simenv map.launch", "'map.launch'; launch files: simenv: "),
        ("roslaunch fleet_manager robot.launch name:=a model:=b z:=1", "'z'; arguments of "),
        ("roslaunch fleet_manager robot.launch name:=a", "'model'; robot.launch: required"),
        ("rosrun simenv draw", "'draw'; nodes of simenv: "),
        ("rosrun simenv draw_map --size 1", "'--size'; options of draw_map: "),
    ],
)
def test_what_does_not_exist_is_found(line, said):
    with pytest.raises(NoSuchThingError, match=re.escape(said)):
        check(line)
