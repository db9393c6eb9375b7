# SPDX-License-Identifier: BSD-3-Clause
"""How long a test on real ROS or in a window may take until it counts as hung.

No verdict depends on how long something takes: a test waits for what it expects, and these limits
only end what hangs. On two processors with two other workers, most files on ROS take less
than 250 s, the longest has taken 320 s, and a case takes a fraction of it. A file that hangs ends
after ten minutes at the latest, and then gets the second look.

As a plugin of pytest, this ends a file after a case that has hung: those behind it would hang too.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pytest

PATIENCE = float(os.environ.get("HIVE_PATIENCE", "180"))
"""For one thing that a case waits for [s, wall clock]."""

CASE = 300.0
"""For a case with what is started for it, in case that it hangs elsewhere [s, wall clock]."""

FILE = 600.0
"""For a file, in case that nothing within it ends it [s, wall clock]."""


def pytest_exception_interact(
    node: pytest.Item | pytest.Collector, report: pytest.CollectReport | pytest.TestReport
) -> None:
    """Run no further case after one that has waited in vain."""
    if getattr(report, "duration", 0.0) >= PATIENCE:
        node.session.shouldstop = f"{node.name} has hung"
