# SPDX-License-Identifier: BSD-3-Clause
"""Every node can be loaded where ROS, Qt and OMPL are: no import is missing or misspelt."""

import ast
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
NODES = sorted(path for path in ROOT.glob("src/*/nodes/*") if path.is_file())


@pytest.mark.parametrize("path", NODES, ids=lambda path: f"{path.parts[-3]}/{path.name}")
def test_what_a_node_runs_can_be_loaded(path):
    imports = [s for s in ast.parse(path.read_text()).body if isinstance(s, ast.ImportFrom)]
    loaded = [getattr(import_module(s.module), name.name) for s in imports for name in s.names]

    assert any(callable(thing) for thing in loaded)
