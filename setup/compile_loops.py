#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fills the cache of compiled inner loops: imports every module that has some."""

import sys
from importlib import import_module
from pathlib import Path

SOURCES = Path(__file__).resolve().parents[1] / "src"
MARK = "from hive_common.compiled import compiled"

if __name__ == "__main__":
    sys.path[:0] = [str(path) for path in SOURCES.glob("*/src")]
    for path in sorted(SOURCES.glob("*/src/**/*.py")):
        if MARK in path.read_text():
            parts = path.relative_to(SOURCES).with_suffix("").parts
            sys.stderr.write(f"compiling {path.relative_to(SOURCES)}\n")
            import_module(".".join(parts[2:]))
