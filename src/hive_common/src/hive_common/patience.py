# SPDX-License-Identifier: BSD-3-Clause
"""Waiting with a limit that a busy machine does not cut short."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

MOST_OF_A_LOOK = 0.02  # counts of the time that one look takes [s, wall clock]


def listen_until(
    is_done: Callable[[], bool],
    seconds: float,
    listen: Callable[[float], None],
    wall: Callable[[], float],
    look: float = MOST_OF_A_LOOK,
) -> bool:
    """Listen until something is done, or nobody has patience any more.

    A process that had no processor for a second finds, when it has one again, that a limit on the
    wall clock is over, though what it waits for came long ago. Of each look, therefore, at most
    `MOST_OF_A_LOOK` counts. A wait takes as long as it should on a machine that keeps up, and
    longer on one that does not.

    Args:
        is_done: Whether the wait is over; asked before the first look and after each.
        seconds: The limit, at least 0 [s, of looks].
        listen: Takes in what comes for up to that long [s, wall clock].
        wall: Gives the wall clock [s].
        look: The longest look, above 0 [s, wall clock].

    Returns:
        Whether it was done within the limit.
    """
    left = seconds
    while not is_done():
        if left <= 0.0:
            return False
        begun = wall()
        listen(min(look, left))
        left -= min(wall() - begun, MOST_OF_A_LOOK)
    return True
