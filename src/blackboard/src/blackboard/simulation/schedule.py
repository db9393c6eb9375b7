# SPDX-License-Identifier: BSD-3-Clause
"""What happens to a simulated hive, as values that a person can read and a seed can draw.

Times are in seconds from the start, after which the hive has `SETTLE` to come together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from random import Random
from typing import TYPE_CHECKING

from blackboard.pose import Pose
from blackboard.simulation.network import Quality
from blackboard.task import Task, TaskType

if TYPE_CHECKING:
    from collections.abc import Callable

SETTLE = 6.0
"""Nothing happens before this time, in which the hive is founded [s]."""

TROUBLE = 36.0
"""How long things go wrong after that [s]."""

BLACKBOARD = "blackboard"


@dataclass(frozen=True, slots=True)
class Crash:
    """A process ends, perhaps while it writes to its disk, and perhaps comes back."""

    at: float
    member: str
    back_after: float | None
    disk_lost: bool = False
    while_writing: bool = False

    def __str__(self) -> str:
        how = " at its next write to disk" if self.while_writing else ""
        disk = " without its disk" if self.disk_lost else ""
        back = (
            "for ever"
            if self.back_after is None
            else f"and is back{disk} {self.back_after:.2f} s later"
        )
        return f"{self.at:6.2f} {self.member} crashes{how} {back}"


@dataclass(frozen=True, slots=True)
class Freeze:
    """A process is stopped for a while and does not know it."""

    at: float
    member: str
    lasts: float

    def __str__(self) -> str:
        return f"{self.at:6.2f} {self.member} freezes for {self.lasts:.2f} s"


@dataclass(frozen=True, slots=True)
class Cut:
    """Nothing passes from some members to the others for a while; or both ways."""

    at: float
    members: tuple[str, ...]
    lasts: float
    one_way: bool = False

    def __str__(self) -> str:
        way = "is not heard by" if self.one_way else "is cut off from"
        return f"{self.at:6.2f} {', '.join(self.members)} {way} the others for {self.lasts:.2f} s"


@dataclass(frozen=True, slots=True)
class BadLinks:
    """All links lose, double and delay for a while."""

    at: float
    lasts: float
    quality: Quality

    def __str__(self) -> str:
        q = self.quality
        return (
            f"{self.at:6.2f} for {self.lasts:.2f} s links lose {q.loss:.0%}, "
            f"double {q.double:.0%}, delay up to {q.delay:.2f} s"
        )


@dataclass(frozen=True, slots=True)
class PowerCut:
    """Every member ends at once, and all come back, each at a time of its own."""

    at: float
    lasts: float

    def __str__(self) -> str:
        return f"{self.at:6.2f} the power of all is cut for {self.lasts:.2f} s"


@dataclass(frozen=True, slots=True)
class SetState:
    """An operator sets a robot's state."""

    at: float
    robot: str
    word: str

    def __str__(self) -> str:
        return f"{self.at:6.2f} an operator sets {self.robot} {self.word}"


@dataclass(frozen=True, slots=True)
class Post:
    """An operator posts a task, again and again until it is taken in or refused."""

    at: float
    task: Task

    def __str__(self) -> str:
        task = self.task
        name = TaskType(task.type).name
        return f"{self.at:6.2f} an operator posts {task.id}: {name}, priority {task.priority}"


@dataclass(frozen=True, slots=True)
class Cancel:
    """An operator cancels a task."""

    at: float
    task: str

    def __str__(self) -> str:
        return f"{self.at:6.2f} an operator cancels {self.task}"


Happening = Crash | Freeze | Cut | BadLinks | PowerCut | SetState | Post | Cancel


@dataclass(frozen=True, slots=True)
class Schedule:
    """A hive and what happens to it.

    Attributes:
        seed: Of the chances of the run itself: delays, losses, jitter, drives.
        robots: How many robots there are besides the blackboard node.
        happenings: In any order.
    """

    seed: int
    robots: int
    happenings: tuple[Happening, ...]

    @property
    def members(self) -> tuple[str, ...]:
        """Names of the members."""
        return (BLACKBOARD, *(f"robot{number + 1}" for number in range(self.robots)))

    def __str__(self) -> str:
        ordered = sorted(self.happenings, key=lambda each: each.at)
        head = f"seed {self.seed}, {BLACKBOARD} and {self.robots} robots"
        return "\n".join([head, *map(str, ordered)])


def draw(seed: int) -> Schedule:
    """Draw a few tasks and a few faults, of which no more disks are lost than is promised for."""
    random = Random(seed)
    robots = random.randint(2, 4)
    members = Schedule(seed, robots, ()).members
    posts = [_post(random, number) for number in range(random.randint(4, 8))]
    cancels = [
        Cancel(post.at + random.uniform(0.0, 15.0), post.task.id)
        for post in posts
        if random.random() < _CANCELLED
    ]
    faults: list[Happening] = []
    for _ in range(random.randint(1, 6)):
        at = SETTLE + random.uniform(0.0, TROUBLE)
        kind = random.choices(list(_KINDS), list(_KINDS.values()))[0]
        faults += kind(random, members, at)
    return Schedule(seed, robots, (*posts, *cancels, *_keep_disks(faults)))


_CANCELLED = 0.1
"""Share of the tasks that an operator cancels."""


def _post(random: Random, number: int) -> Post:
    kind = random.choice(list(TaskType))
    goals = tuple(
        Pose(random.uniform(0.0, 9.0), random.uniform(0.0, 9.0))
        for _ in range(random.randint(kind.goals_needed, 3))
    )
    priority, payload = random.choice([0, 0, 5, 9]), random.uniform(0.0, 5.0)
    task = Task(f"T{number + 1}", kind, goals, priority, payload)
    return Post(SETTLE + random.uniform(0.0, 0.7 * TROUBLE), task)


def _crash(random: Random, members: tuple[str, ...], at: float) -> list[Happening]:
    how = random.choices(["plain", "disk lost", "for ever"], [8, 1, 1])[0]
    back_after = random.choice([0.3, 1.0, 3.0, 12.0]) * random.random()
    return [
        Crash(
            at,
            random.choice(members),
            None if how == "for ever" else back_after,
            disk_lost=how == "disk lost",
            while_writing=random.choice([True, False]),
        )
    ]


def _freeze(random: Random, members: tuple[str, ...], at: float) -> list[Happening]:
    return [Freeze(at, random.choice(members), random.choice([0.8, 3.0, 6.0, 14.0]))]


def _cut(random: Random, members: tuple[str, ...], at: float) -> list[Happening]:
    group = tuple(random.sample(members, random.randint(1, len(members) - 1)))
    return [Cut(at, group, random.uniform(0.5, 14.0), random.choice([True, False]))]


def _bad_links(random: Random, _: tuple[str, ...], at: float) -> list[Happening]:
    quality = Quality(
        random.choice([0.0, 0.1, 0.3, 0.5]),
        random.choice([0.0, 0.2]),
        random.choice([0.02, 0.5, 2.0]),
    )
    return [BadLinks(at, random.uniform(2.0, 20.0), quality)]


def _power_cut(random: Random, _: tuple[str, ...], at: float) -> list[Happening]:
    return [PowerCut(at, random.uniform(0.1, 5.0))]


def _defect(random: Random, members: tuple[str, ...], at: float) -> list[Happening]:
    robot = random.choice(members[1:])
    back = at + random.uniform(1.0, 15.0)
    return [SetState(at, robot, "defect"), SetState(back, robot, "idle")]


_KINDS: dict[Callable[[Random, tuple[str, ...], float], list[Happening]], int] = {
    _crash: 7,
    _freeze: 4,
    _cut: 4,
    _bad_links: 3,
    _power_cut: 1,
    _defect: 1,
}
"""How often each kind of fault comes, relative to the others."""


def _keep_disks(faults: list[Happening]) -> list[Happening]:
    """Let no more than one disk be lost or gone: of three members, two would be the majority."""
    kept: list[Happening] = []
    lost = False
    for fault in faults:
        if isinstance(fault, Crash) and (fault.disk_lost or fault.back_after is None):
            kept.append(replace(fault, disk_lost=False, back_after=1.0) if lost else fault)
            lost = True
        else:
            kept.append(fault)
    return kept
