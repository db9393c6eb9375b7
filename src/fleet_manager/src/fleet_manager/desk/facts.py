# SPDX-License-Identifier: BSD-3-Clause
"""What the hive tells an operator's desk, and what the desk may ask of the hive.

Facts and commands are plain values, so that the desk does not care whether they come from topics,
from a file or from a test. `HiveLink` is the port through which both pass.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Protocol

from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.costing.bid_basis import Bids
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskUpdate
from blackboard.domain.task import Task

if TYPE_CHECKING:
    from collections.abc import Sequence

    from blackboard.auction.decision import Decision
    from fleet_manager.desk.places import Place
    from hive_common.pose import Pose


@dataclass(frozen=True, slots=True)
class Moment:
    """One instant on the two clocks of a desk.

    Attributes:
        ros: The hive's time, which may be simulated [s].
        wall: A clock that never jumps nor stops, for noticing silence [s].
    """

    ros: float
    wall: float


Report = Task | TaskList | TaskUpdate | Bids | RobotStatus | Heartbeat
"""Whatever the hive says on its topics; a Task has been posted by somebody."""


@dataclass(frozen=True, slots=True)
class Told:
    """Something that the hive said.

    Attributes:
        report: What it said.
        stamp: When it was said [s, hive's time].
    """

    report: Report
    stamp: float


@dataclass(frozen=True, slots=True)
class Clicked:
    """A person pointed at the map in RViz.

    Attributes:
        pose: Where [in `frame`]; its yaw counts only with `has_heading`.
        frame: The frame that RViz shows.
        has_heading: Whether the person dragged an arrow (2D Nav Goal) or clicked (Publish Point).
    """

    pose: Pose
    frame: str
    has_heading: bool


@dataclass(frozen=True, slots=True)
class MapBounds:
    """Where the map ends [m, map frame]."""

    x_min: float
    y_min: float
    x_max: float
    y_max: float


@dataclass(frozen=True, slots=True)
class PlannedPath:
    """The way a robot is about to drive (topic <robot>/move_base/plan); empty when it stands."""

    robot: str
    points: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Located:
    """Where a robot believes it is (topic <robot>/amcl_pose), oftener than it reports."""

    robot: str
    pose: Pose


class LinkState(Enum):
    """How the desk stands with the ROS master."""

    SEARCHING = "searching"
    """No master has answered yet."""
    UP = "up"
    """Connected."""
    LOST = "lost"
    """It was there and no longer answers; what was connected goes on without it."""


@dataclass(frozen=True, slots=True)
class LinkChange:
    """The ROS master came or went.

    Attributes:
        state: How the desk stands with it.
        master: Its address, for a person.
    """

    state: LinkState
    master: str


@dataclass(frozen=True, slots=True)
class PlacesKnown:
    """The named places of the world that the hive works in."""

    places: tuple[Place, ...]


@dataclass(frozen=True, slots=True)
class Noted:
    """A decision that a member of the hive has noted on this machine."""

    decision: Decision


Fact = Told | Clicked | MapBounds | PlannedPath | Located | PlacesKnown | LinkChange | Noted


@dataclass(frozen=True, slots=True)
class PostTask:
    """Ask the hive to take a task in."""

    task: Task


@dataclass(frozen=True, slots=True)
class CancelTask:
    """Ask the hive to take a task off its list."""

    task_id: str


@dataclass(frozen=True, slots=True)
class SetRobotState:
    """Ask a robot to go out of service (DEFECT) or back into it (IDLE)."""

    robot: str
    state: RobotState


@dataclass(frozen=True, slots=True)
class AskWhy:
    """Ask what has been noted about a task's auctions; each is answered with a `Noted`."""

    task_id: str


Wish = PostTask | CancelTask | SetRobotState
"""What the hive is told on its topics."""

Command = Wish | AskWhy


class HiveLink(Protocol):
    """The way between a desk and a hive. No call ever waits for anything."""

    def start(self) -> None:
        """Begin to connect, in the background."""

    def stop(self) -> None:
        """Disconnect."""

    def now(self) -> float:
        """Return the hive's time [s]; 0 before it is known."""

    def drain(self, limit: int) -> Sequence[Fact]:
        """Return at most `limit` facts that have arrived since the last call, oldest first."""

    def send(self, command: Command) -> None:
        """Hand over a command; it is sent as soon as the link allows."""
