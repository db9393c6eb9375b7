# SPDX-License-Identifier: BSD-3-Clause
"""Where the windows' forms and translations lie, in the source tree and when installed."""

from __future__ import annotations

from pathlib import Path


def resource_folder() -> Path:
    """Return the package's `resource` folder.

    It is found beside this file and not by asking ROS, so that forms and words can be tested where
    there is none.

    Raises:
        FileNotFoundError: The package is not installed completely.
    """
    for parent in Path(__file__).resolve().parents:
        for folder in (parent / "resource", parent / "share" / "fleet_manager" / "resource"):
            if (folder / "task_entry.ui").is_file():
                return folder
    raise FileNotFoundError("fleet_manager/resource is missing; build and install it again")
