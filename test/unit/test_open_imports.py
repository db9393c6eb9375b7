# SPDX-License-Identifier: BSD-3-Clause
"""What a module needs of our packages it imports at its top, where import-linter and people look.

An import inside a function hides a circle from readers, and a module that is named in a string
(for `import_module`, `python -m` or `python -c`) is hidden from import-linter altogether. What
another process is to run is a node, found by `hive_common.resources.node_file`, or a module that
is imported and whose `__name__` is used.
"""

import ast
import re
from pathlib import Path

import pytest

from fleet_manager.cli.main import hive
from hive_lab.bench.registry import BENCHES

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = sorted(path.parent for path in ROOT.glob("src/*/package.xml"))
OURS = {package.name for package in PACKAGES}

EXCEPTIONS = {
    "blackboard.ros.path_lengths": {
        "blackboard.costing.grid_path_lengths": "scipy, 6 MB in each process of a robot: only for "
        "those that are given a map",
    },
    "blackboard.ros.search_process": {
        "blackboard.auction.search.worker": "the program of a process of its own, because the "
        "compiler's runtime takes 70 MB",
    },
    "blackboard.ros.transport": dict.fromkeys(
        (
            "blackboard.ros.drives",
            "blackboard.ros.relay",
            "blackboard.zenoh.link",
            "blackboard.zenoh.opening",
        ),
        "Zenoh's engine, 10 MB in each process: only where the hive speaks over it",
    ),
    "fleet_manager.cli.main": {
        "fleet_manager.cli.": "a command's module, by its word and only beside it: loading all "
        "takes longer than most commands do",
    },
    "fleet_manager.ros.command_line": {
        "blackboard.ros.journals": "rosgraph, for the commands that read journals",
        "fleet_manager.ros.client_link": "rospy takes longer than --help and tab completion may",
        "fleet_manager.ros.fault_link": "rospy, as above",
        "fleet_manager.config.zenoh_operator": "fleet files, for commands with --connect",
        "fleet_manager.zenoh.client_link": "Zenoh's engine, as above",
    },
    "fleet_manager.gui.program": dict.fromkeys(
        ("fleet_manager.config.zenoh_operator", "fleet_manager.zenoh.desk_link"),
        "Zenoh's engine, 10 MB, for windows with --connect",
    ),
    "hive_lab.bench.registry": {
        "hive_lab.": "a benchmark's module, by its word: some need ROS, Qt or OMPL, and the list "
        "of benchmarks needs none",
    },
    "hive_navigation.ros.traffic_planner_node": {
        "hive_navigation.ros.traffic_planner": "it listens while it loads the planner, for which "
        "robots wait after a takeover",
    },
}
"""By module, what it imports out of sight, and why there is no other way."""

LOADERS = {"import_module", "__import__", "run_module", "run_path", "find_spec"}
NAMED = re.compile(rf"\b(?:{'|'.join(sorted(OURS))})(?:\.\w+)*\.?")


def module_of(path):
    """Return the dotted name of a file below a package's `src`; that of a node is its path."""
    parts = path.relative_to(ROOT / "src").with_suffix("").parts
    return ".".join(part for part in parts[2:] if part != "__init__") or "/".join(parts)


SOURCES = {module_of(path): path for path in sorted(ROOT.glob("src/*/src/**/*.py"))}
NODES = {
    str(path.relative_to(ROOT / "src")): path
    for path in sorted(ROOT.glob("src/*/nodes/*"))
    if path.is_file()
}
MODULES = {*SOURCES, *(f"{name}.{kind}" for name in OURS for kind in ("msg", "srv"))} - OURS


class Hidden(ast.NodeVisitor):
    """Collects what a module of ours gets from our packages, other than by imports at its top."""

    def __init__(self, module):
        self.module = module
        self.found = set()
        self._depth = 0

    def visit_FunctionDef(self, node):
        self._depth += 1
        self.generic_visit(node)
        self._depth -= 1

    visit_AsyncFunctionDef = visit_FunctionDef  # noqa: N815  (ast's name)

    def visit_Import(self, node):
        self._note(alias.name for alias in node.names)

    def visit_ImportFrom(self, node):
        base = "." * node.level + (node.module or "")
        names = [f"{base}.{alias.name}" for alias in node.names]
        self._note(name if name in MODULES else base for name in names)

    def _note(self, names):
        if self._depth:
            self.found |= {name for name in names if name.partition(".")[0] in {*OURS, ""}}

    def visit_Expr(self, node):
        if not isinstance(node.value, ast.Constant):  # what is left out here are docstrings
            self.generic_visit(node)

    def visit_Call(self, node):
        name = getattr(node.func, "attr", getattr(node.func, "id", ""))
        if name in LOADERS and not any(
            isinstance(a, ast.Constant | ast.JoinedStr) for a in node.args
        ):
            self.found.add(f"{name}({ast.unparse(node.args[0]) if node.args else ''})")
        self.generic_visit(node)

    def visit_JoinedStr(self, node):
        for part in node.values:
            if isinstance(part, ast.Constant):
                self._read(part.value, open_end=True)
            else:
                self.visit(part)

    def visit_Constant(self, node):
        if isinstance(node.value, str):
            self._read(node.value)

    def _read(self, text, *, open_end=False):
        for match in NAMED.finditer(text):
            name = match[0]
            if open_end and name.endswith(".") and match.end() == len(text):
                self.found.add(name)
                continue
            while name and name.rstrip(".") not in MODULES:
                name = name.rpartition(".")[0]
            self.found |= {name.rstrip(".")} - {"", self.module}


def hidden(module, text):
    """Return what a module gets from our packages out of sight."""
    visitor = Hidden(module)
    visitor.visit(ast.parse(text))
    return visitor.found


@pytest.mark.parametrize("package", sorted(OURS))
def test_what_a_module_needs_of_our_packages_it_imports_at_its_top(package):
    found = {
        module: hidden(module, path.read_text(encoding="utf-8"))
        for module, path in {**SOURCES, **NODES}.items()
        if path.is_relative_to(ROOT / "src" / package)
    }
    allowed = {
        module: set(names)
        for module, names in EXCEPTIONS.items()
        if module.partition(".")[0] == package
    }

    assert {module: names for module, names in found.items() if names} == allowed


def test_the_command_line_loads_only_modules_beside_it():
    loaded = {
        hive.get_command(None, word).callback.__module__ for word in hive.list_commands(None)
    }

    assert {
        module for module in loaded if module.rpartition(".")[0] != "fleet_manager.cli"
    } == set()


def test_every_benchmark_is_a_module_of_the_lab_that_can_run():
    sources = {name: SOURCES.get(f"hive_lab.{bench.module}") for name, bench in BENCHES.items()}

    assert [name for name, path in sources.items() if path is None] == []
    assert [
        name
        for name, path in sources.items()
        if not re.search(r"^def run\(", path.read_text(encoding="utf-8"), re.MULTILINE)
    ] == []


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("from blackboard.domain import bid", set()),
        ("def f():\n    from blackboard.domain import bid", {"blackboard.domain.bid"}),
        ("def f():\n    from blackboard.domain.bid import Bid", {"blackboard.domain.bid"}),
        ("def f():\n    import blackboard.domain.bid", {"blackboard.domain.bid"}),
        ("def f():\n    from . import bid", {"."}),
        ("async def f():\n    import simenv.errors", {"simenv.errors"}),
        ("def f():\n    import xacro", set()),
        ("import_module('blackboard.domain.bid')", {"blackboard.domain.bid"}),
        ("import_module(f'blackboard.{name}')", {"blackboard."}),
        ("importlib.import_module(name)", {"import_module(name)"}),
        ("[python, '-m', 'simenv.errors']", {"simenv.errors"}),
        ("[python, '-c', 'from simenv.errors import Error']", {"simenv.errors"}),
        ("look('blackboard.msg')", {"blackboard.msg"}),
        ("look('python3 -m simenv.spoken')", set()),
        ("look('fleet_manager fleet_manager.launch')", set()),
        ("'''See blackboard.domain.bid.'''", set()),
    ],
)
def test_what_is_hidden_is_found(text, names):
    assert hidden("simenv.spoken", text) == names
