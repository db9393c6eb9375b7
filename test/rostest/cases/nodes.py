# SPDX-License-Identifier: BSD-3-Clause
"""Every node can be loaded where ROS, Qt and OMPL are: no import is missing or misspelt."""

from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
NODES = sorted(path for path in ROOT.glob("src/*/nodes/*") if path.is_file())


@pytest.mark.parametrize("path", NODES, ids=lambda path: f"{path.parts[-3]}/{path.name}")
def test_a_node_can_be_loaded_and_has_a_main(path):
    loader = SourceFileLoader(f"node_{path.name}", str(path))
    node = module_from_spec(spec_from_loader(loader.name, loader))
    loader.exec_module(node)

    assert callable(node.main)
