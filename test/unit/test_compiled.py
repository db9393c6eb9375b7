# SPDX-License-Identifier: BSD-3-Clause
"""Compiled functions call compiled functions of their own module only: see decision 091."""

from __future__ import annotations

import ast
from pathlib import Path

SOURCES = Path(__file__).resolve().parents[2] / "src"
MARK = "from hive_common.compiled import compiled"


def is_compiled(node: ast.AST) -> bool:
    return isinstance(node, ast.FunctionDef) and any(
        isinstance(each, ast.Call) and ast.unparse(each.func) == "compiled"
        for each in node.decorator_list
    )


def imported_calls(source: str) -> set[str]:
    """Return what compiled functions of a module call that it imports from our packages."""
    module = ast.parse(source)
    packages = {path.name for path in SOURCES.iterdir()}
    imported = {
        name.asname or name.name
        for node in ast.walk(module)
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in packages
        for name in node.names
    }
    return {
        call.func.id
        for function in filter(is_compiled, ast.walk(module))
        for call in ast.walk(function)
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name)
    } & (imported - {"compiled"})


def test_compiled_functions_call_no_function_of_another_module() -> None:
    modules = [path for path in SOURCES.glob("*/src/**/*.py") if MARK in path.read_text()]

    assert len(modules) > 3
    assert {
        path.name: found for path in modules if (found := imported_calls(path.read_text()))
    } == {}


def test_a_call_into_another_module_is_found() -> None:
    source = f"{MARK}\nfrom simenv.a import b, c\n@compiled()\ndef f():\n    return b()\nc()\n"

    assert imported_calls(source) == {"b"}
