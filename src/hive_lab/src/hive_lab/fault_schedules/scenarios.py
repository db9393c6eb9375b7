# SPDX-License-Identifier: BSD-3-Clause
"""Scenarios that produce the moments which a rule of the protocol is made for.

Each draws a hive and faults that belong together: a crash right after a vote, messages that arrive
long after their epoch, two members that start at once while the others are cut off.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING

from blackboard.domain.settings import RaftSettings
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose
from hive_lab.fault_schedules.faulty_network import Quality
from hive_lab.fault_schedules.schedule import (
    BLACKBOARD,
    FAULT_PERIOD,
    LEADER,
    OPERATOR,
    SETTLE,
    BadLinks,
    Crash,
    Cut,
    FaultSchedule,
    Freeze,
    FullDisk,
    Loss,
    LyingDisk,
    Post,
    Recover,
    SetState,
    SlowDisk,
    Strike,
    Trigger,
    WritePoint,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from random import Random

    from hive_lab.fault_schedules.schedule import Happening


STRONG_ROBOT = "a strong robot comes and goes"
"""The scenario in which the last robot carries several times as much as the others."""

ONE_CHARGER = "robots share a charger"
"""The scenario in which all robots charge in turn at the same charger."""

_LEADER_SLEEPS = 0.4  # share of the times at which the leader's machine alone is suspended


@dataclass
class Setting:
    """A hive in a scenario; the fields are those of `FaultSchedule`."""

    robots: int
    faults: list[Happening]
    settings: RaftSettings = field(default_factory=lambda: RaftSettings(kept_changes=4))
    late: tuple[tuple[str, float], ...] = ()
    far_clocks: bool = False
    proofs: float = 0.9


def _members(robots: int) -> tuple[str, ...]:
    return FaultSchedule(0, robots, ()).members


def _times(random: Random, most: int) -> list[float]:
    """Draw when faults occur [s]."""
    count = random.randint(2, most)
    return sorted(SETTLE + random.uniform(0.0, 0.8 * FAULT_PERIOD) for _ in range(count))


def _close(random: Random) -> RaftSettings:
    """Draw timers with which several members become candidates almost at once."""
    stagger = random.choice([0.01, 0.05, 0.25])
    return RaftSettings(kept_changes=4, stagger=stagger)


def _short(random: Random) -> float:
    """Draw a duration that fits into an election [s]."""
    return random.choice([0.05, 0.2, 0.5, 2.0]) * random.random() + 0.005


def _unseat(random: Random, at: float, members: tuple[str, ...]) -> Happening:
    """Draw a fault that takes the leader away for long enough."""
    kind = random.choice(["crash", "freeze", "cut", "cut", "link", "deaf"])
    lasts = random.uniform(2.3, 7.0)
    if kind == "crash":
        return Crash(at, LEADER, random.choice([_short(random), lasts]))
    if kind == "freeze":
        return Freeze(at, LEADER, lasts)
    if kind == "link":
        some = random.sample(members, random.randint(1, len(members) - 1))
        return Cut(at, (LEADER,), lasts, others=tuple(some))
    return Cut(at, (LEADER,), lasts, one_way=kind == "deaf")


def _strike(random: Random, at: float, members: tuple[str, ...]) -> Strike:
    """Draw a short fault at a turning point."""
    trigger, lasts = random.choice(list(Trigger)), _short(random)
    kind = random.choice(["crash", "crash", "freeze", "cut", "link"])
    if kind == "crash":
        point = random.choice(list(WritePoint))
        return Strike(at, trigger, Crash(at, "", lasts), point)
    if kind == "freeze":
        return Strike(at, trigger, Freeze(at, "", lasts * random.choice([1.0, 4.0])))
    lasts = random.uniform(0.2, 6.0)
    others = () if kind == "cut" else (random.choice(members),)
    return Strike(at, trigger, Cut(at, (), lasts, random.choice([True, False]), others))


def _storm(random: Random) -> Setting:
    """Lose the leader again and again, and hit whoever is about to follow it."""
    robots = random.randint(2, 4)
    members = _members(robots)
    faults: list[Happening] = []
    for at in _times(random, 5):
        faults.append(_unseat(random, at, members))
        faults += [_strike(random, at, members) for _ in range(random.randint(1, 3))]
    return Setting(
        robots,
        faults,
        _close(random),
        far_clocks=random.choice([True, False]),
        proofs=random.choice([0.0, 0.9]),
    )


def _late_messages(random: Random) -> Setting:
    """Deliver messages after the epoch in which they were sent, singly or all at once."""
    robots = random.choice([2, 4])
    members = _members(robots)
    quality = Quality(
        random.choice([0.0, 0.2, 0.4]),
        random.choice([0.0, 0.5]),
        random.choice([0.02, 0.2, 2.0]),
        random.choice([0.0, 0.05, 0.5]),
        random.choice([1.0, 3.0, 9.0]),
    )
    faults: list[Happening] = [BadLinks(SETTLE, FAULT_PERIOD - 4.0, quality)]
    for at in _times(random, 8):
        way, lasts = random.choice([True, False]), random.uniform(2.0, 4.0)
        cut = Cut(at, (LEADER,), lasts, way, holds=True)
        faults.append(random.choice([cut, cut, _unseat(random, at, members)]))
        # A handback is written to disk, and so is the next assignment.
        robot = random.choice(members[1:])
        faults.append(SetState(at + 2 * _short(random), robot, "defect"))
        faults.append(SetState(at + random.uniform(1.0, 3.0), robot, "idle"))
    far = random.choice([True, False])
    return Setting(robots, faults, _close(random), far_clocks=far)


def _restarts(random: Random) -> Setting:
    """Restart members whose votes are needed, while others miss the leader."""
    robots = random.randint(2, 4)
    members = _members(robots)
    faults: list[Happening] = []
    for at in _times(random, 4):
        lasts = random.uniform(3.0, 8.0)
        some = random.sample(members, random.randint(1, len(members) - 1))
        faults.append(Cut(at, (LEADER,), lasts, random.choice([True, False]), tuple(some)))
        for _ in range(random.randint(1, 4)):
            when = at + random.uniform(0.0, lasts)
            faults.append(Crash(when, random.choice(members), _short(random)))
    proofs = random.choice([0.0, 0.9])
    return Setting(robots, faults, _close(random), far_clocks=True, proofs=proofs)


def _come_and_go(random: Random) -> Setting:
    """Remove and add members by twos while the hive is partitioned."""
    robots = random.randint(3, 5)
    members = _members(robots)
    first = SETTLE + random.uniform(0.0, 8.0)
    late = tuple(
        (name, first + random.uniform(0.0, 0.4))
        for name in random.sample(members[1:], random.randint(1, 3))
    )
    faults: list[Happening] = []
    for at in (first, *_times(random, 4)):
        pair = random.sample(members, 2)
        back = random.uniform(0.5, 8.0)
        if random.choice([True, False]):
            faults += [Crash(at + random.uniform(0.0, 0.3), name, back) for name in pair]
        half = tuple(random.sample(members, random.randint(1, len(members) // 2)))
        lasts = random.uniform(2.5, 8.0)
        if random.choice([True, False]):
            cut = Cut(at, (), lasts, others=half)
            faults.append(Strike(at, Trigger.CHANGES_MEMBERS, cut))
        else:
            faults.append(Cut(at + random.uniform(0.0, 4.0), half, lasts))
    settings = RaftSettings(kept_changes=4, member_timeout=random.choice([2.5, 4.0, 10.0]))
    return Setting(robots, faults, settings, late)


def _lost_disks(random: Random) -> Setting:
    """Lose disks while some members lag behind, and the leader right afterwards."""
    robots = random.randint(2, 4)
    members = _members(robots)
    faults: list[Happening] = []
    for at in _times(random, 4):
        behind, lost = random.sample(members, 2)
        lasts = random.uniform(1.0, 6.0)
        faults.append(Cut(at, (behind,), lasts))
        when = at + random.uniform(0.0, lasts)
        faults.append(Crash(when, lost, _short(random), disk_lost=True))
        faults.append(_unseat(random, when + _short(random), members))
    return Setting(robots, faults, _close(random))


def _founder_alone(random: Random) -> Setting:
    """Lose the blackboard node's disk while it hears nobody, except perhaps the operator."""
    robots = random.randint(2, 4)
    at = SETTLE + random.uniform(0.0, 0.4 * FAULT_PERIOD)
    alone = (BLACKBOARD, OPERATOR) if random.choice([True, False]) else (BLACKBOARD,)
    lasts = random.uniform(3.0, 15.0)
    faults: list[Happening] = [
        Cut(at, alone, lasts, random.choice([True, False, False])),
        Crash(at + random.uniform(0.0, 1.0), BLACKBOARD, _short(random), disk_lost=True),
    ]
    if random.choice([True, False]):
        faults.append(_unseat(random, at + random.uniform(0.0, lasts), _members(robots)))
    return Setting(robots, faults)


def _deaf_robots(random: Random) -> Setting:
    """Let robots be heard that hear nothing, so that they repeat what the hive soon forgets."""
    robots = random.randint(2, 4)
    members = _members(robots)
    faults: list[Happening] = []
    for at in _times(random, 4):
        deaf = random.choice(members[1:])
        others = tuple(name for name in members if name != deaf)
        faults.append(Cut(at, others, random.uniform(4.0, 20.0), one_way=True, others=(deaf,)))
        if random.choice([True, False, False]):
            faults.append(_unseat(random, at + random.uniform(0.0, 4.0), members))
    return Setting(robots, faults)


def _bad_disks(random: Random) -> Setting:
    """Fill disks and slow them down, and end processes that could not write."""
    robots = random.randint(2, 4)
    members = _members(robots)
    faults: list[Happening] = []
    for at in _times(random, 5):
        who = random.choice([LEADER, *members[1:], *members[1:]])
        lasts = random.choice([1.0, 4.0, 10.0]) * random.uniform(0.5, 1.5)
        if random.choice([True, False]):
            faults.append(SlowDisk(at, who, lasts, random.choice([0.03, 0.3])))
            continue
        faults.append(FullDisk(at, who, lasts))
        if random.choice([True, False]):
            crash = Crash(at + random.uniform(0.0, lasts), who, _short(random))
            faults.append(crash)
    return Setting(robots, faults, _close(random))


def _lying_disks(random: Random) -> Setting:
    """Have disks confirm writes too early, and cut the power of single machines."""
    robots = random.randint(2, 4)
    members = _members(robots)
    liars = random.sample(members, random.randint(1, len(members)))
    faults: list[Happening] = [LyingDisk(0.0, who, random.choice([0.03, 0.3])) for who in liars]
    for at in _times(random, 5):
        lasts = _short(random)
        if random.choice([True, False]):
            who = random.choice([LEADER, *members])
            faults.append(Crash(at, who, lasts, power=True))
        else:
            loss = Crash(0.0, "", lasts, power=True)
            faults.append(Strike(at, random.choice(list(Trigger)), loss, WritePoint.AFTER))
        if random.choice([True, False]):
            faults.append(_unseat(random, at + random.uniform(0.0, 0.5), members))
    return Setting(robots, faults, _close(random))


def _sleeping_machines(random: Random) -> Setting:
    """Suspend machines, whose clocks go on, and lose or hold what is sent to them meanwhile."""
    robots = random.randint(2, 4)
    members = _members(robots)
    faults: list[Happening] = []
    for at in _times(random, 4):
        some = random.sample(members, random.randint(1, len(members) - 1))
        for who in [LEADER] if random.random() < _LEADER_SLEEPS else some:
            lasts = random.uniform(1.0, 12.0)
            faults.append(Freeze(at, who, lasts))
            faults.append(Cut(at, (who,), lasts, holds=random.choice([True, False])))
        if random.choice([True, False]):
            faults.append(_strike(random, at + random.uniform(0.0, 12.0), members))
    return Setting(robots, faults, _close(random), far_clocks=random.choice([True, False]))


def _strong_robot(random: Random) -> Setting:
    """Set a strong robot defect and idle while tasks wait that it alone carries in one piece."""
    robots = random.randint(2, 4)
    members = _members(robots)
    strong = members[-1]
    faults: list[Happening] = [SetState(0.5, strong, "defect")]
    for number, at in enumerate(sorted([*_times(random, 3), *_times(random, 3)])):
        kind = random.choice([TaskType.GA, TaskType.GAB])
        goals = tuple(Pose(9.0 * random.random(), 9.0 * random.random()) for _ in range(2))
        task = Task(f"H{number + 1}", kind, goals, payload=random.uniform(25.0, 60.0))
        faults.append(Post(at, task))
    for at in _times(random, 3):
        faults.append(SetState(at, strong, "idle"))
        faults.append(SetState(at + random.uniform(2.0, 12.0), strong, "defect"))
        kind_of_fault = random.choice(["links", "links", "cut", "unseat", "crash"])
        when = at + random.uniform(0.0, 6.0)
        if kind_of_fault == "links":
            quality = Quality(random.choice([0.0, 0.2]), 0.5, random.choice([0.5, 2.0, 4.0]))
            faults.append(BadLinks(at, random.uniform(4.0, 12.0), quality))
        elif kind_of_fault == "cut":
            lasts = random.uniform(1.0, 8.0)
            one_way = random.choice([True, False])
            robot = random.choice(members[1:])
            faults.append(Cut(when, (robot,), lasts, one_way, holds=random.choice([True, False])))
        elif kind_of_fault == "unseat":
            faults.append(_unseat(random, when, members))
        else:
            faults.append(Crash(when, random.choice(members[1:]), _short(random)))
    return Setting(robots, faults, _close(random))


def _no_majority(random: Random) -> Setting:
    """Lose a third of the members or more for good, with their disks, while others lag behind."""
    robots = random.randint(2, 4)
    members = _members(robots)
    at = SETTLE + random.uniform(1.0, 0.6 * FAULT_PERIOD)
    lost = random.sample(members, random.randint(len(members) // 2, len(members) - 1))
    left = [name for name in members if name not in lost]
    faults: list[Happening] = [Loss(at, tuple(lost))]
    for before in (at - random.uniform(0.0, 6.0), at - random.uniform(0.0, 2.0)):
        lasts = random.uniform(0.5, 20.0)
        if random.choice([True, False]):
            faults.append(Cut(before, (random.choice(left),), lasts))
        else:
            faults.append(_strike(random, before, members))
    faults += [
        Crash(when, random.choice(left), _short(random))
        for when in (at + random.uniform(0.0, 6.0), at + random.uniform(12.0, 30.0))
        if random.choice([True, False])
    ]
    if random.choice([True, False]):
        faults.append(Recover(at + random.uniform(4.0, 15.0)))
    return Setting(robots, faults, _close(random))


def _one_charger(random: Random) -> Setting:
    """Send robots to the only charger and call them back, while members fail and messages lag."""
    robots = random.randint(2, 4)
    members = _members(robots)
    faults: list[Happening] = []
    for at in (*_times(random, 4), *_times(random, 4)):
        robot = random.choice(members[1:])
        faults.append(SetState(at, robot, "charge"))
        if random.choice([True, False]):
            faults.append(SetState(at + random.uniform(0.2, 6.0), robot, "idle"))
    for at in _times(random, 5):
        who, lasts = random.choice(members[1:]), random.uniform(1.0, 9.0)
        kind = random.choice(["links", "cut", "cut", "unseat", "unseat", "crash", "freeze"])
        if kind == "links":
            quality = Quality(random.choice([0.0, 0.2]), 0.5, random.choice([0.5, 2.0, 4.0]))
            faults.append(BadLinks(at, lasts, quality))
        elif kind == "cut":
            way, holds = random.choice([True, False]), random.choice([True, False])
            faults.append(Cut(at, (who,), lasts, way, holds=holds))
        elif kind == "unseat":
            faults.append(_unseat(random, at, members))
        elif kind == "freeze":
            faults.append(Freeze(at, who, lasts))
        else:
            faults.append(Crash(at, who, random.choice([_short(random), 2.0 * lasts])))
    return Setting(robots, faults, _close(random), far_clocks=random.choice([True, False]))


SCENARIOS: Mapping[str, Callable[[Random], Setting]] = MappingProxyType(
    {
        "election storm": _storm,
        "late messages": _late_messages,
        "quick restarts": _restarts,
        "members come and go": _come_and_go,
        "lost disks": _lost_disks,
        "a founder alone": _founder_alone,
        "deaf robots": _deaf_robots,
    }
)
"""The docstring of each says what it is for."""

ASIDE: Mapping[str, Callable[[Random], Setting]] = MappingProxyType(
    {
        "bad disks": _bad_disks,
        "lying disks": _lying_disks,
        "no majority left": _no_majority,
        ONE_CHARGER: _one_charger,
        "sleeping machines": _sleeping_machines,
        STRONG_ROBOT: _strong_robot,
    }
)
"""Scenarios that are drawn only by name, so that those above keep their seeds."""
