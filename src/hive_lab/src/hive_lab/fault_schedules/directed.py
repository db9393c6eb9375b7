# SPDX-License-Identifier: BSD-3-Clause
"""Schedules written by hand, for situations that chance hardly ever produces."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

from attrs import evolve

from blackboard.domain.settings import RaftSettings
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose
from hive_lab.fault_schedules.schedule import (
    BLACKBOARD,
    BOARD_SETTINGS,
    LEADER,
    OPERATOR,
    Crash,
    Cut,
    FaultSchedule,
    Freeze,
    Post,
    Strike,
    Trigger,
    WritePoint,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hive_lab.fault_schedules.schedule import Happening

_SEED = 0  # of the small delays; the schedules are tuned for this seed

_TASK = Task("T1", TaskType.GA, (Pose(1.0, 2.0),))
_TWO_GOALS = Task("T1", TaskType.GAB, (Pose(1.0, 2.0), Pose(2.0, 2.0)))
_POSTED = Post(8.0, _TASK)


def _schedule(
    name: str,
    *happenings: Happening,
    robots: int = 2,
    stagger: float = 0.25,
    keep_ended: float = 3600.0,
) -> FaultSchedule:
    """Return a schedule for the blackboard node and some robots."""
    settings = RaftSettings(kept_changes=4, stagger=stagger)
    board = evolve(BOARD_SETTINGS, keep_ended=keep_ended)
    return FaultSchedule(_SEED, robots, happenings, settings, board, scenario=name)


# The blackboard node and robot2 both ask robot1 for its vote in epoch 2. The blackboard node wins
# and can tell nobody; only then robot2 learns that robot1 would vote for it, and is a candidate.
_RIVALS = (
    Cut(12.0, (BLACKBOARD,), 3.0, others=("robot1",)),
    Cut(12.0, (BLACKBOARD,), 20.0, others=("robot2",)),
    Cut(12.0, ("robot1",), 6.2, one_way=True, others=("robot2",), holds=True),
    Strike(13.0, Trigger.TAKES_OVER, Cut(0.0, (), 10.0), WritePoint.BEFORE_SAYING),
)

# Robot2 becomes a candidate long after robot1; its vote request arrives 2.5 s late.
_LATE_VOTE = (
    Cut(12.0, (BLACKBOARD,), 12.0),
    Cut(12.0, ("robot1",), 5.5, others=("robot2",)),
    Strike(
        16.0, Trigger.STANDS, Cut(0.0, (), 2.5, one_way=True, holds=True), WritePoint.BEFORE_SAYING
    ),
)

# An entry of epoch 1 reaches a majority in epoch 3, and a member with a conflicting entry of
# epoch 2 is elected in epoch 4.
_FIGURE_8 = (
    Cut(12.0, (BLACKBOARD, OPERATOR), 4.0),
    Post(12.5, Task("T2", TaskType.GA, (Pose(1.0, 2.0),))),
    Strike(12.6, Trigger.TAKES_OVER, Crash(0.0, "", 6.0), WritePoint.BEFORE_SAYING),
    Strike(16.0, Trigger.WRITES, Cut(0.0, (), 3.0)),
    Crash(19.0, BLACKBOARD, 12.0),
)

# Robot1 is heard but hears nothing. It keeps reporting T1 after the hive has forgotten it, and
# after another task with that id was posted, which goes to robot2.
_POSTED_ANEW = (
    Cut(9.0, (BLACKBOARD, "robot2"), 20.0, one_way=True, others=("robot1",)),
    Post(16.0, _TASK, anew=True),
)

# The blackboard node loses its disk while it is cut off, and bootstraps a second hive. When the
# cut ends, the first hive has no leader, and robot2 loses its disk and joins the second, in which
# an operator posts T1 anew.
_SECOND_HIVE = (
    Cut(12.0, (BLACKBOARD,), 7.0),
    Crash(12.5, BLACKBOARD, 0.2, disk_lost=True),
    Post(16.0, _TWO_GOALS),
    Freeze(16.3, LEADER, 9.0),
    Crash(18.9, "robot2", 0.2, disk_lost=True),
    Post(19.3, _TWO_GOALS, anew=True),
)

DIRECTED: Mapping[str, FaultSchedule] = MappingProxyType(
    {
        each.scenario: each
        for each in (
            _schedule("rivals", _POSTED, *_RIVALS),
            _schedule(
                "forgetful rivals",
                *(_POSTED, *_RIVALS, Strike(13.0, Trigger.VOTES, Crash(0.0, "", 0.05))),
            ),
            _schedule("late vote", _POSTED, *_LATE_VOTE, stagger=3.5),
            _schedule("posted anew", _POSTED, *_POSTED_ANEW, keep_ended=1.0),
            _schedule("second hive", *_SECOND_HIVE, robots=4, keep_ended=1.0),
            _schedule("figure 8", _POSTED, *_FIGURE_8),
        )
    }
)
"""By name; the last is figure 8 of the Raft paper, with one change a message."""
