# SPDX-License-Identifier: BSD-3-Clause
"""Exports the instances for solvers that know nothing of Robo-Hive.

Run as `python -m hive_lab.bench.allocation.export FOLDER`; see setup/reference.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from hive_lab.bench.allocation.instances import SIZES, Floor, instances


def export(folder: Path) -> None:
    """Write each instance as `<name>.npz` with `way` and `inner`, `/` in its name as `_`."""
    folder.mkdir(parents=True, exist_ok=True)
    floor = Floor()
    for size in SIZES:
        for name, instance in instances(size, floor):
            path = folder / f"{name.replace('/', '_')}.npz"
            np.savez_compressed(path, way=instance.way, inner=instance.tasks.inner)


if __name__ == "__main__":
    export(Path(sys.argv[1]))
