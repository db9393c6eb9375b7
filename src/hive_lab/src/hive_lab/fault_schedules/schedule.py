# SPDX-License-Identifier: BSD-3-Clause
"""What happens to a simulated hive, as values that a person can read and a seed can draw.

Times are in seconds from the start; the hive has `SETTLE` to bootstrap first.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING

import attrs

from blackboard.domain.settings import BlackboardSettings, RaftSettings
from blackboard.domain.task import TaskType
from hive_lab.fault_schedules.features.kit import RobotKit

if TYPE_CHECKING:
    from blackboard.domain.task import Task
    from hive_lab.fault_schedules.faulty_network import Quality

SETTLE = 6.0  # nothing goes wrong before this time, while the hive bootstraps [s]
FAULT_PERIOD = 36.0  # how long faults occur after that [s]
BLACKBOARD = "blackboard"
OPERATOR = "operator"

BY_HAND = "by hand"  # scenario of a schedule that was not drawn

BOARD_SETTINGS = BlackboardSettings(retry_period=10.0)
"""The blackboard's settings unless a schedule has its own."""

LEADER = "the leader"  # in place of a name: whoever is the leader at that time


@dataclass(frozen=True, slots=True)
class Crash:
    """A process crashes, perhaps during a write to disk, and perhaps comes back."""

    at: float
    member: str
    back_after: float | None
    disk_lost: bool = False
    while_writing: bool = False
    power: bool = False  # its machine loses power, and its disk what it only claims to have

    def __str__(self) -> str:
        how = " at its next write to disk" if self.while_writing else ""
        how += ", as its machine loses power," if self.power else ""
        disk = " without its disk" if self.disk_lost else ""
        back = (
            "for ever"
            if self.back_after is None
            else f"and is back{disk} {self.back_after:.2f} s later"
        )
        return f"{self.at:6.2f} {self.member} crashes{how} {back}"


@dataclass(frozen=True, slots=True)
class Freeze:
    """A process is suspended for a while, without noticing."""

    at: float
    member: str
    lasts: float

    def __str__(self) -> str:
        return f"{self.at:6.2f} {self.member} freezes for {self.lasts:.2f} s"


@dataclass(frozen=True, slots=True)
class Cut:
    """No message passes from some members to others, or to all others, for a while; or both ways.

    Messages sent meanwhile are lost, or held and delivered all at once in the end, as TCP does.
    """

    at: float
    members: tuple[str, ...]
    lasts: float
    one_way: bool = False
    others: tuple[str, ...] = ()
    holds: bool = False

    def __str__(self) -> str:
        way = "is not heard by" if self.one_way else "is cut off from"
        others = ", ".join(self.others) or "the others"
        end = ", then all comes at once" if self.holds else ""
        who = ", ".join(self.members)
        return f"{self.at:6.2f} {who} {way} {others} for {self.lasts:.2f} s{end}"


@dataclass(frozen=True, slots=True)
class BadLinks:
    """All links lose, duplicate and delay messages for a while."""

    at: float
    lasts: float
    quality: Quality

    def __str__(self) -> str:
        q = self.quality
        return (
            f"{self.at:6.2f} for {self.lasts:.2f} s links lose {q.loss:.0%}, "
            f"duplicate {q.double:.0%}, delay up to {q.delay:.2f} s"
            + (f"; {q.late:.0%} come up to {q.latest:.2f} s late" if q.late else "")
            + (f"; {q.load}" if q.load.takes else "")
        )


@dataclass(frozen=True, slots=True)
class RouterLoss:
    """The routers of a hive over Zenoh hang for a while, or not at all, and are then replaced."""

    at: float
    hang: float

    def __str__(self) -> str:
        hang = f"hang for {self.hang:.2f} s and " if self.hang else ""
        return f"{self.at:6.2f} the routers {hang}end; members connect to others"


@dataclass(frozen=True, slots=True)
class FullDisk:
    """Nothing can be written to a member's disk for a while."""

    at: float
    member: str
    lasts: float

    def __str__(self) -> str:
        return f"{self.at:6.2f} the disk of {self.member} is full for {self.lasts:.2f} s"


@dataclass(frozen=True, slots=True)
class SlowDisk:
    """Every write to a member's disk holds its process up for a while."""

    at: float
    member: str
    lasts: float
    takes: float

    def __str__(self) -> str:
        takes = f"takes {self.takes * 1000:.0f} ms for a write for {self.lasts:.2f} s"
        return f"{self.at:6.2f} the disk of {self.member} {takes}"


@dataclass(frozen=True, slots=True)
class LyingDisk:
    """A member's disk confirms each write some time before it would survive a loss of power."""

    at: float
    member: str
    lag: float

    def __str__(self) -> str:
        lag = f"{self.lag * 1000:.0f} ms before they are on it"
        return f"{self.at:6.2f} from now on the disk of {self.member} confirms writes {lag}"


@dataclass(frozen=True, slots=True)
class PowerCut:
    """All members lose power at once; each comes back at a time of its own."""

    at: float
    lasts: float

    def __str__(self) -> str:
        return f"{self.at:6.2f} the power of all is cut for {self.lasts:.2f} s"


@dataclass(frozen=True, slots=True)
class Loss:
    """Some members are lost for good with their disks, even if they are a majority."""

    at: float
    members: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.at:6.2f} {', '.join(self.members)} are lost for good, disks included"


@dataclass(frozen=True, slots=True)
class Recover:
    """An operator has a member go on without the others: `hive recover --force-members`.

    Without a name it is the newest that is left, if the hive cannot go on.
    """

    at: float
    member: str = ""

    def __str__(self) -> str:
        who = f"with {self.member} alone" if self.member else "if no majority is left"
        return f"{self.at:6.2f} an operator recovers the hive {who}"


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
    """An operator posts a task, again and again until it is accepted or rejected.

    Posted `anew`, it counts as new once the hive has forgotten it.
    """

    at: float
    task: Task
    anew: bool = False

    def __str__(self) -> str:
        task = self.task
        name = TaskType(task.type).name
        anew = " anew" if self.anew else ""
        what = f"posts {task.id}{anew}: {name}, priority {task.priority}"
        return f"{self.at:6.2f} an operator {what}"


@dataclass(frozen=True, slots=True)
class Cancel:
    """An operator cancels a task."""

    at: float
    task: str

    def __str__(self) -> str:
        return f"{self.at:6.2f} an operator cancels {self.task}"


class Trigger(Enum):
    """A turning point of a member, recognised by what it writes to disk."""

    STANDS = "begins an epoch"
    VOTES = "votes for another"
    TAKES_OVER = "takes over"
    CHANGES_MEMBERS = "writes down another list of members"
    WRITES = "writes down a change"


class WritePoint(Enum):
    """When a strike hits, relative to the write."""

    BEFORE_WRITING = "before it is on disk"
    BEFORE_SAYING = "before it says so"
    AFTER = "and has said so"


@dataclass(frozen=True, slots=True)
class Strike:
    """A fault that waits for the next member that reaches a turning point, and hits that member.

    Attributes:
        at: When it begins to wait [s].
        trigger: What it waits for.
        fault: What happens then, to that member.
        point: When exactly. A freeze always comes after the message, and so does a cut unless
            `BEFORE_SAYING`.
    """

    at: float
    trigger: Trigger
    fault: Crash | Freeze | Cut
    point: WritePoint = WritePoint.AFTER

    def __str__(self) -> str:
        fault = str(self.fault)[7:].strip()
        return f"{self.at:6.2f} the next that {self.trigger.value} {self.point.value}: {fault}"


Happening = (
    Crash
    | Freeze
    | Cut
    | BadLinks
    | RouterLoss
    | FullDisk
    | SlowDisk
    | LyingDisk
    | PowerCut
    | Strike
    | Loss
    | Recover
    | SetState
    | Post
    | Cancel
)


@dataclass(frozen=True, slots=True)
class Site:
    """What connects the members of a hive over Zenoh.

    Attributes:
        routers: Whether all they say goes through routers.
        twice: Whether every message arrives on two ways, as with peers of two routers.
    """

    routers: bool = False
    twice: bool = False

    def __str__(self) -> str:
        routers = " through routers" if self.routers else ""
        return f"over Zenoh{routers}{', each message twice' if self.twice else ''}"


@dataclass(frozen=True, slots=True)
class FaultSchedule:
    """A hive and what happens to it.

    Attributes:
        seed: Of the chances during the run: delays, losses, jitter, drives.
        robots: Number of robots.
        happenings: In any order.
        settings: Of every member's Raft node.
        board: Of the blackboard.
        late: Members that start at a given time [s]; the others start within the first second.
        far_clocks: Whether every clock has the largest error allowed.
        proofs: Share of the deaths that others get proof of.
        scenario: What it was drawn for.
        aside: Robots that are learners.
        kits: What each robot is; by default all are equal.
        site: What connects the members over Zenoh; None if they speak as over ROS.
    """

    seed: int
    robots: int
    happenings: tuple[Happening, ...]
    settings: RaftSettings = field(default_factory=lambda: RaftSettings(kept_changes=4))
    board: BlackboardSettings = BOARD_SETTINGS
    late: tuple[tuple[str, float], ...] = ()
    far_clocks: bool = False
    proofs: float = 0.9
    scenario: str = BY_HAND
    aside: tuple[str, ...] = ()
    kits: tuple[RobotKit, ...] = ()
    site: Site | None = None

    def kit_of(self, member: str) -> RobotKit:
        """Return what a member's robot is; that of the blackboard node does not matter."""
        named = dict(zip(self.members[1:], self.kits, strict=False))
        return named.get(member, RobotKit())

    @property
    def members(self) -> tuple[str, ...]:
        """Names of the members."""
        return (BLACKBOARD, *(f"robot{number + 1}" for number in range(self.robots)))

    def __str__(self) -> str:
        ordered = sorted(self.happenings, key=lambda each: each.at)
        head = f"seed {self.seed} ({self.scenario}), {BLACKBOARD} and {self.robots} robots"
        usual = RaftSettings(kept_changes=4)
        timers = [
            f"{name} {getattr(self.settings, name):g}"
            for name in ("election", "stagger", "member_timeout", "most_members")
            if getattr(self.settings, name) != getattr(usual, name)
        ]
        if self.board.keep_ended != BOARD_SETTINGS.keep_ended:
            kept = f"{self.board.most_ended} ended tasks kept, for {self.board.keep_ended:g} s"
            timers.append(kept)
        clocks = ["clocks 1 % wrong"] if self.far_clocks else []
        proofs = [] if self.proofs else ["no death is proven"]
        aside = [f"{', '.join(self.aside)} aside"] if self.aside else []
        site = [str(self.site)] if self.site else []
        late = [f"{at:6.2f} {name} is started for the first time" for name, at in self.late]
        kits = zip(self.members[1:], self.kits, strict=False)
        fleet = [f"       {name}: {kit}" for name, kit in kits]
        return "\n".join(
            [
                ", ".join([head, *timers, *self._board(), *clocks, *proofs, *aside, *site]),
                *fleet,
                *late,
                *map(str, ordered),
            ]
        )

    def _board(self) -> list[str]:
        """Return the blackboard's settings that are not the usual ones."""
        told = {"keep_ended", "most_ended"}
        return [
            f"{each.name} {getattr(self.board, each.name)}"
            for each in attrs.fields(BlackboardSettings)
            if each.name not in told
            and getattr(self.board, each.name) != getattr(BOARD_SETTINGS, each.name)
        ]
