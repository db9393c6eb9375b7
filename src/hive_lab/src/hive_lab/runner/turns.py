# SPDX-License-Identifier: BSD-3-Clause
"""Lets a test that needs the whole machine run while no other one of its kind does."""

from __future__ import annotations

import contextlib
import fcntl
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@contextlib.contextmanager
def turn(folder: Path, *, alone: bool) -> Iterator[None]:
    """Wait for a turn, and have it until the context ends, in whichever process.

    Who wants to be alone waits for all others that have a turn; meanwhile nobody else gets one, so
    it does not wait for longer than the longest of them.

    Args:
        folder: In which those who take turns with each other have their locks.
        alone: Whether nobody else may have a turn at the same time.
    """
    files = (folder / "robo-hive-next", folder / "robo-hive-turn")
    with files[0].open("w") as queue, files[1].open("w") as taken:
        fcntl.flock(queue, fcntl.LOCK_EX)
        fcntl.flock(taken, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        fcntl.flock(queue, fcntl.LOCK_UN)
        yield
