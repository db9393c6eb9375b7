# SPDX-License-Identifier: BSD-3-Clause
"""Schedules written by hand, for situations that chance hardly ever produces."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from attrs import evolve

from blackboard.domain.settings import RaftSettings
from blackboard.domain.task import Task, TaskType
from blackboard.robot.charging import ChargingPlan
from hive_common.pose import Pose
from hive_lab.fault_schedules.faulty_network import Quality
from hive_lab.fault_schedules.features.kit import RobotKit
from hive_lab.fault_schedules.schedule import (
    BLACKBOARD,
    BOARD_SETTINGS,
    LEADER,
    OPERATOR,
    BadLinks,
    Cancel,
    Crash,
    Cut,
    FaultSchedule,
    Freeze,
    FullDisk,
    Loss,
    Post,
    Recover,
    SetState,
    Strike,
    Trigger,
    WritePoint,
)
from hive_lab.virtual.hive import SMALL_ROBOT

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hive_lab.fault_schedules.schedule import Happening

_SEED = 0  # of the small delays; the schedules are tuned for their seeds

_TASK = Task("T1", TaskType.GA, (Pose(1.0, 2.0),))
_TWO_GOALS = Task("T2", TaskType.GAB, (Pose(1.0, 2.0), Pose(2.0, 2.0)))
_PICK = Task("T1", TaskType.GPA, (Pose(1.0, 2.0),), payload=2.0)


def _tour(goals: int, stride: float = 1.0) -> Task:
    """Return a task of many short drives, so that a robot is at work for a while."""
    places = (Pose(stride * number, float(number % 2)) for number in range(goals))
    return Task("T1", TaskType.GAB, tuple(places))


def _another(name: str) -> Task:
    return replace(_TASK, id=name)


def _schedule(
    name: str,
    *faults: Happening,
    task: Task = _TASK,
    stagger: float = 0.25,
    keep_ended: float = 3600.0,
    robots: int = 2,
    late: tuple[tuple[str, float], ...] = (),
    far_clocks: bool = False,
    seed: int = _SEED,
) -> FaultSchedule:
    """Return a schedule for the blackboard node and some robots, to which a task is posted.

    The members wait for a silent leader equally long in all of them, however quick the links are.
    """
    settings = RaftSettings(kept_changes=4, stagger=stagger, min_election=2.2)
    board = evolve(BOARD_SETTINGS, keep_ended=keep_ended)
    happenings = (Post(8.0, task), *faults)
    return FaultSchedule(
        seed, robots, happenings, settings, board, late, far_clocks, scenario=name
    )


def _few_asked(schedule: FaultSchedule, *kits: RobotKit) -> FaultSchedule:
    """Return a schedule whose leader asks one robot for bids first, with robots as given."""
    return replace(schedule, board=evolve(schedule.board, most_asked=1), kits=kits)


def _with_learner(schedule: FaultSchedule, *aside: str) -> FaultSchedule:
    """Return a schedule in which some robots are learners."""
    return replace(schedule, aside=aside)


def _posted_and_cancelled(at: float, count: int) -> tuple[Happening, ...]:
    """Return tasks that are posted from a time on, and cancelled within 4 s [s]."""
    names = [f"X{number}" for number in range(count)]
    posts = (Post(at + 0.1 * number, _another(name)) for number, name in enumerate(names))
    ends = (Cancel(at + 2.0 + 0.1 * number, name) for number, name in enumerate(names))
    return (*posts, *ends)


def _impatient(schedule: FaultSchedule, *kits: RobotKit) -> FaultSchedule:
    """Return a schedule in which tasks are soon overdue, with robots as given."""
    board = evolve(schedule.board, overdue_factor=1.0, overdue_grace=1.0)
    return replace(schedule, board=board, kits=kits)


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

# Robot1 votes for the blackboard node as in `_RIVALS`, and its process is restarted soon after.
_RESTARTED_VOTER = (*_RIVALS, Crash(15.3, "robot1", 0.05))

# The blackboard node writes down three tasks of which nobody hears. Robot2 writes one change in
# epoch 2, and robot1 holds it too; then the blackboard node and robot1 are left.
_LONGER_LIST: tuple[Happening, ...] = (
    Cut(12.0, (BLACKBOARD, OPERATOR), 4.0),
    *(Post(12.2 + 0.4 * number, _another(f"T{number + 2}")) for number in range(3)),
    Crash(15.9, LEADER, 6.0),
)

# The blackboard node adds robot4 to the list of four, and robot1, leader in epoch 2, adds robot5.
# Three of five are a majority of either list: the blackboard node, robot3 and robot4, or robot1,
# robot2 and robot5. Only robot3 has heard both leaders, and it lacks the first change of robot1.
_TWO_NEW_MEMBERS = (
    Cut(0.0, ("robot5",), 30.0, others=(BLACKBOARD, "robot3", "robot4")),
    Cut(0.0, ("robot4",), 30.0, others=("robot1", "robot2", "robot3")),
    Cut(12.55, (BLACKBOARD,), 16.0, others=("robot1", "robot2")),
    Cut(12.55, (BLACKBOARD,), 4.5, others=("robot3",)),
    Strike(
        13.0, Trigger.TAKES_OVER, Cut(0.0, (), 16.0, others=("robot3",)), WritePoint.BEFORE_SAYING
    ),
)

# Robot1 is the last to answer the blackboard node, and is restarted right after. Robot2 has missed
# the blackboard node for long enough, and asks robot1 for its vote.
_SHORT_SILENCE = (
    Cut(16.0, (BLACKBOARD,), 8.0, others=("robot2",)),
    Cut(17.5, (BLACKBOARD,), 5.0, others=("robot1",)),
    Crash(17.5, "robot1", 0.05),
)

# The same, but robot1 could not write down that robot2 has joined. By its disk, the members are
# itself and the blackboard node.
_OLD_LIST = (
    FullDisk(13.5, "robot1", 5.0),
    Cut(16.0, (BLACKBOARD,), 8.0, others=("robot2",)),
    Cut(18.5, (BLACKBOARD,), 5.0, others=("robot1",)),
    Crash(18.5, "robot1", 0.05),
)

# Robot1 is heard once, and is gone before it gets the list. The blackboard node is restarted.
_GONE_AT_ONCE = (Crash(2.0, "robot1", None), Crash(2.4, BLACKBOARD, 0.3))

# Robot1 misses the blackboard node for 14 s, while robot2 hears it for most of the time. Just when
# robot3 has a vote and is gone for good, robot1 is heard again. Only a blackboard node that still
# leads can go on without robot3.
_NEEDLESS_ELECTION = (
    Cut(12.0, ("robot1",), 13.65, others=(BLACKBOARD,)),
    Cut(23.0, ("robot2",), 10.0, others=(BLACKBOARD,)),
    Crash(25.45, "robot3", None),
    Post(30.0, _another("T2")),
)

# Robot2 stands in epochs 2 and 3, and nobody hears it. The others elect a leader in epoch 2.
# Robot2 repeats that T2 is done, and cannot hear from that leader that this is known.
_AHEAD = (
    SetState(10.0, "robot1", "defect"),
    Post(11.5, _another("T2")),
    Cut(12.0, (BLACKBOARD,), 3.5),
    Strike(13.0, Trigger.STANDS, Cut(0.0, (), 0.37, one_way=True), WritePoint.BEFORE_SAYING),
    Cut(14.627, ("robot2",), 4.0, one_way=True),
)

# Robot1 is picking when it is cut off, until it is lost.
_LOST_LOAD = (Cut(11.0, ("robot1",), 12.0),)

# The first STARTED of robot1 comes late, when its arm picks; then robot1 is lost.
_LATE_START = (
    BadLinks(8.017, 0.004, Quality(late=1.0, latest=9.0)),
    Cut(11.3, ("robot1",), 12.0),
)

# The clock of robot1 is slow and that of the blackboard node fast, and the blackboard node looks
# just when the lease of robot1 would be over by its own clock.
_END_OF_LEASE = (Cut(11.6, ("robot1",), 12.0),)

# The order for robot1 is on its way until robot1 is lost, its task is given to robot2, and robot1
# is heard again.
_LATE_ORDER = (
    Cut(8.012, (BLACKBOARD,), 7.0, one_way=True, others=("robot1",), holds=True),
    Cut(8.012, ("robot1",), 6.0, one_way=True, others=(BLACKBOARD,)),
)

# Robot1 hears late that the hive has forgotten T1. Meanwhile another T1 is posted and robot1 does
# it, and its report is lost.
_LATE_WORD = (
    SetState(7.0, "robot2", "defect"),
    Cut(11.0, (BLACKBOARD,), 3.7, one_way=True, others=("robot1",)),
    Cancel(12.0, "T1"),
    BadLinks(14.0, 1.0, Quality(late=1.0, latest=5.5)),
    Post(15.2, replace(_TASK, goals=_tour(9).goals[-1:]), anew=True),
    Cut(16.3, ("robot1",), 2.0, one_way=True, others=(BLACKBOARD,)),
)

# Robot1 hands T1 back, the report comes 7 s later, and robot1 is restarted in the meantime.
_LATE_HANDBACK = (
    SetState(12.0, "robot1", "defect"),
    BadLinks(12.0005, 0.05, Quality(late=1.0, latest=8.0)),
    Crash(12.05, "robot1", 0.3),
)

# The blackboard node loses its disk while it is cut off, and bootstraps another hive, in which T1
# is posted anew. Tasks that are posted and cancelled there make its list the longer one. Robot1
# has lost all other members of the first hive when the two meet; robot2, a learner, has T1 there.
_LONE_HIVE = (
    SetState(6.5, "robot2", "defect"),
    SetState(6.5, "robot3", "defect"),
    SetState(9.0, "robot2", "idle"),
    SetState(9.3, "robot1", "defect"),
    SetState(11.0, "robot1", "idle"),
    Cut(12.0, (BLACKBOARD, OPERATOR), 17.9),
    Crash(12.5, BLACKBOARD, 0.3, disk_lost=True),
    Post(18.0, replace(_tour(40, 0.5), priority=9), anew=True),
    *_posted_and_cancelled(18.1, 8),
    Loss(26.0, ("robot3",)),
)

# Only robot1 hears the other hive.
_BUSY_ROBOT = (*_LONE_HIVE, Cut(12.0, (BLACKBOARD,), 24.0, others=("robot2",)))

# Robot2 joins the other hive, in which T1 has a lower number and is cancelled. Only robot2 can do
# T2.
_OTHER_HIVE = (
    *_LONE_HIVE,
    Cancel(21.0, "T1"),
    Loss(32.0, ("robot1",)),
    Post(33.0, _another("T2")),
)

# The blackboard node bootstraps another hive as above, and robot1 is frozen while the first one
# goes on without it. It gives way to the other hive just before its own has two members again.
# Only then the blackboard node hears of robot1's hive, and gives way to that.
_SWAPPED_HIVES = (
    Cut(12.7, (BLACKBOARD, OPERATOR), 14.7),
    Cut(12.7, (BLACKBOARD,), 24.0, others=("robot2",)),
    Crash(13.6, BLACKBOARD, 0.5, disk_lost=True),
    *_posted_and_cancelled(17.0, 9),
    Freeze(25.8, "robot1", 4.1),
    Post(33.0, _another("T2")),
)

# Three of five members are lost for good, and an operator has the blackboard node go on alone.
# robot1, which runs on, has to do T2.
_RECOVERED = (
    Loss(12.0, ("robot2", "robot3", "robot4")),
    Recover(24.0, BLACKBOARD),
    Post(30.0, _another("T2")),
)

# An operator has the blackboard node go on alone while it is only cut off from the two others.
_RECOVERED_TOO_SOON = (
    Cut(12.0, (BLACKBOARD,), 14.0),
    Recover(14.0, BLACKBOARD),
    Post(17.0, _another("T2")),
)

# The same, and two robots that hear only the blackboard node join it, so its hive is the larger
# one when the cut ends. The other hive has accepted T2, and waits for a person.
_RECOVERED_BESIDE = (
    Cut(12.0, ("robot1", "robot2"), 16.0, others=(BLACKBOARD, "robot3", "robot4")),
    Recover(14.0, BLACKBOARD),
    Cut(17.5, (BLACKBOARD, "robot3", "robot4"), 4.5, others=(OPERATOR,)),
    Post(18.0, replace(_tour(18), id="T2")),
)

# Of the answers to the assignment of T2, one arrives, after the lease of the blackboard node has
# ended.
_OLD_ANSWER = (
    Post(12.0, _another("T2")),
    BadLinks(12.014, 0.02, Quality(late=1.0, latest=3.0)),
    Cut(12.04, ("robot1", "robot2"), 3.0, one_way=True, others=(BLACKBOARD,)),
)

# Robot1 is restarted when it has the last change on disk and does not know that it is committed.
_NOTHING_ELSE = (Crash(9.75, "robot1", 0.1),)

_ELECTIONS = (
    _schedule("rivals", *_RIVALS, seed=1),
    _schedule(
        "forgetful rivals",
        *_RIVALS,
        Strike(13.0, Trigger.VOTES, Crash(0.0, "", 0.05)),
        seed=1,
    ),
    _schedule("a restarted voter", *_RESTARTED_VOTER, seed=1),
    _schedule("late vote", *_LATE_VOTE, stagger=3.5),
    _schedule("a longer list", *_LONGER_LIST),
    _schedule("a short silence", *_SHORT_SILENCE, seed=1),
    _schedule("an old list", *_OLD_LIST, late=(("robot2", 14.0),)),
    _schedule("gone at once", *_GONE_AT_ONCE, late=(("robot2", 6.0),)),
    _schedule("a needless election", *_NEEDLESS_ELECTION, robots=3, late=(("robot3", 25.0),)),
    _schedule("an epoch ahead", *_AHEAD),
    _schedule(
        "two new members",
        *_TWO_NEW_MEMBERS,
        robots=5,
        late=(("robot4", 12.0), ("robot5", 12.5)),
    ),
    _schedule("figure 8", *_FIGURE_8),
    _schedule("an old answer", *_OLD_ANSWER, seed=131),
    _schedule("nothing else happens", *_NOTHING_ELSE),
)

# The blackboard node loses its disk while it is cut off, and bootstraps a second hive. When the
# cut ends, the first hive has no leader, and robot2 loses its disk and joins the second, in which
# an operator posts T2 anew.
_SECOND_HIVE = (
    Cut(12.0, (BLACKBOARD,), 7.0),
    Crash(12.5, BLACKBOARD, 0.2, disk_lost=True),
    Post(16.0, _TWO_GOALS),
    Freeze(16.3, LEADER, 9.0),
    Crash(18.9, "robot2", 0.2, disk_lost=True),
    Post(19.3, _TWO_GOALS, anew=True),
)

# A second copy of the order for T1 reaches robot1 when T1 is done and forgotten, and the
# blackboard node cannot hear that robot1 has it again.
_FORGOTTEN_ORDER = (
    BadLinks(8.004, 0.02, Quality(double=1.0, late=0.5, latest=3.4)),
    Cut(10.0, ("robot1",), 3.0, one_way=True, others=(BLACKBOARD,)),
)

# Robot1, the only one that can take T2, misses the first call for bids.
_TOO_SLOW = (
    Cut(13.95, ("robot1",), 2.5),
    Post(14.0, replace(_TASK, id="T2", payload=60.0, no_split=True)),
)
_STRONG = RobotKit(characteristics=replace(SMALL_ROBOT, payload=100.0))


def _pick_after_a_restart(cancelled: float, checked: float) -> tuple[Happening, ...]:
    """Return what happens while the arm of robot1 picks for T1, whose process restarts.

    T1 is cancelled at a time [s]. A person says at a later time that nothing is on board [s], and
    robot1 gets T2.
    """
    return (
        SetState(7.0, "robot2", "defect"),
        Crash(10.05, "robot1", 0.1),
        Cancel(cancelled, "T1"),
        SetState(checked, "robot1", "idle"),
        Post(checked + 0.3, replace(_PICK, id="T2")),
    )


# T1 is cancelled while there is no process.
_LATE_PICK = _pick_after_a_restart(cancelled=10.07, checked=10.95)

# T1 is cancelled when the next process drives to its place again.
_DROPPED_PICK = _pick_after_a_restart(cancelled=10.3, checked=10.8)

_CARRY = Task("T1", TaskType.GPAB, (Pose(1.0, 2.0), Pose(2.0, 2.0)), payload=2.0)


def _later_load(*, disk_lost: bool) -> tuple[Happening, ...]:
    """Return what happens to robot1, which carries the load of T1.

    It is cut off, and its process restarts, with its disk or without. T1 fails and is forgotten.
    Another T1 is posted just when robot1 is heard again, the only robot in service.
    """
    return (
        SetState(7.0, "robot2", "defect"),
        Cut(11.5, ("robot1",), 10.5),
        Crash(12.7, "robot1", 0.7, disk_lost=disk_lost),
        Post(22.2, _CARRY, anew=True),
    )


# Robot1 does T1 while its disk is full, and its process ends before anybody hears of it.
_FULL_DISK = (
    SetState(6.5, "robot2", "defect"),
    FullDisk(7.5, "robot1", 20.0),
    Cut(8.9, ("robot1",), 1.5),
    Crash(9.9, "robot1", 0.1),
)

# Robot1 freezes in the pause before it tries a drive again, until robot2 works on T1.
_FROZEN_PAUSE = (Freeze(12.0, "robot1", 8.0),)

# Robot1 takes far longer for its drive than it has promised. Its process restarts just before the
# leader has it hand T1 back, and its base drives on.
_RESTARTED_DRIVE = (
    SetState(6.5, "robot2", "defect"),
    SetState(12.0, "robot2", "idle"),
    Crash(28.635, "robot1", 0.05),
)

# The blackboard node loses its disk while it is cut off, and bootstraps a second hive, in which T2
# is posted. Robot1 and robot2 go on without it, are cut off from each other, and the one that
# leads goes on alone. The other hears the second hive first, and believes that its own has two
# members.
_OLD_SIZE = (
    Cut(12.0, (BLACKBOARD, OPERATOR), 14.9),
    Crash(12.5, BLACKBOARD, 0.3, disk_lost=True),
    Post(18.0, _another("T2")),
    *_posted_and_cancelled(18.5, 10),
    Cut(24.8, (LEADER,), 5.4),
)

_WORK = (
    _schedule("posted anew", *_POSTED_ANEW, keep_ended=1.0),
    _schedule("a lost load", *_LOST_LOAD, task=_PICK),
    _schedule("a late start", *_LATE_START, task=_PICK),
    _schedule("end of a lease", *_END_OF_LEASE, task=_tour(9), far_clocks=True, seed=27),
    _schedule("a late order", *_LATE_ORDER, task=_tour(9)),
    _schedule("a late word", *_LATE_WORD, task=_tour(9), keep_ended=1.0, seed=5),
    _schedule("a late handback", *_LATE_HANDBACK, task=_tour(9)),
    _schedule("second hive", *_SECOND_HIVE, robots=4, keep_ended=1.0),
    # With other small delays, the blackboard node is back in the first hive before robot2, which
    # has joined the second, gets a vote there.
    _schedule("a short-lived hive", *_SECOND_HIVE, robots=4, keep_ended=1.0, seed=2000),
    _with_learner(
        _schedule("a busy robot", *_BUSY_ROBOT, task=_tour(40, 0.5), robots=3, seed=1), "robot2"
    ),
    _with_learner(
        _schedule("another hive", *_OTHER_HIVE, task=_tour(40, 0.5), robots=3, seed=1), "robot2"
    ),
    _schedule("swapped hives", *_SWAPPED_HIVES, task=_tour(18, 0.5), seed=177),
    _schedule("a forgotten order", *_FORGOTTEN_ORDER, keep_ended=0.1, seed=194),
    _schedule("an old size", *_OLD_SIZE, task=_tour(40, 0.5), seed=6),
    _impatient(
        _schedule("a restarted drive", *_RESTARTED_DRIVE), RobotKit(stalls=1.0), RobotKit()
    ),
    _few_asked(_schedule("too slow once", *_TOO_SLOW, seed=2), _STRONG, RobotKit()),
    _schedule("a late pick", *_LATE_PICK, task=_PICK),
    _schedule("a dropped pick", *_DROPPED_PICK, task=_PICK, seed=3),
    _schedule("a later load", *_later_load(disk_lost=False), task=_CARRY, keep_ended=0.5),
    _schedule("an unknown load", *_later_load(disk_lost=True), task=_CARRY, keep_ended=0.5),
    _schedule("a full disk", *_FULL_DISK),
    _schedule("a frozen pause", *_FROZEN_PAUSE, task=_tour(9), seed=41),
)

# The leader and robot1 are cut off from the others as robot1 asks the leader for the charger, and
# robot2 asks the next leader for it.
_GIVEN_BY_A_MINORITY = (
    SetState(11.99, "robot1", "charge"),
    Cut(11.991, (BLACKBOARD, "robot1"), 8.0),
    SetState(14.6, "robot2", "charge"),
)

# Robot1 loses its disk where it charges. The task is for robot2, which starts with a nearly empty
# battery and waits for the charger.
_LOST_HOME = (Crash(11.0, "robot1", 0.1, disk_lost=True),)
_HEAVY = Task("T1", TaskType.GA, (Pose(1.0, 2.0),), payload=50.0, no_split=True)

_DOCK = ChargingPlan({"dock": Pose(-6.0, 0.0)})


def _charging_kit(charge: float, payload: float) -> RobotKit:
    """Return a robot that charges at the dock in 30 s; its battery lasts some minutes."""
    battery = replace(SMALL_ROBOT.battery, capacity=0.2, charging_time=30.0)
    body = replace(SMALL_ROBOT, payload=payload, battery=battery)
    return RobotKit(body, charge=charge, charging=_DOCK)


_CHARGING = (
    replace(
        _schedule("given by a minority", *_GIVEN_BY_A_MINORITY, robots=4),
        kits=(RobotKit(charging=_DOCK),) * 4,
    ),
    replace(
        _schedule("a lost home", *_LOST_HOME, task=_HEAVY, late=(("robot2", 9.0),)),
        kits=(_charging_kit(0.25, 20.0), _charging_kit(0.13, 100.0)),
    ),
)

_RECOVERIES = (
    _schedule("recovered", *_RECOVERED, robots=4),
    _schedule("recovered too soon", *_RECOVERED_TOO_SOON),
    _schedule(
        "recovered beside a majority",
        *_RECOVERED_BESIDE,
        robots=4,
        late=(("robot3", 15.0), ("robot4", 15.5)),
    ),
)

DIRECTED: Mapping[str, FaultSchedule] = MappingProxyType(
    {each.scenario: each for each in (*_ELECTIONS, *_WORK, *_CHARGING, *_RECOVERIES)}
)
"""By name; "figure 8" is figure 8 of the Raft paper, with one change a message."""
