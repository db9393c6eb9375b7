# SPDX-License-Identifier: BSD-3-Clause
"""How messages over Zenoh are delivered: what overtakes, what may be lost, what is repeated.

On a connection, messages of one priority keep their order. Where it carries less than is said,
urgent messages overtake the others, and ordinary ones that find no room are dropped.
"""

from __future__ import annotations

from blackboard.domain.characteristics import RobotStatus
from blackboard.domain.talker import ROBOT_STATUS, SYNC

BEST_EFFORT = frozenset({ROBOT_STATUS})
"""Topics on which the next message makes up for one that is lost."""

REPEATED = frozenset({SYNC, ROBOT_STATUS})
"""Topics of which new listeners get what was said last."""


def is_repeated(topic: str, value: object, sender: str) -> bool:
    """Return whether a process repeats a value that it has said for those who listen later.

    A leader also tells the status of robots that it no longer hears; they may be back.
    """
    if isinstance(value, RobotStatus) and value.robot_id != sender:
        return False
    return topic in REPEATED
