# SPDX-License-Identifier: BSD-3-Clause
"""What the hive tells the windows, and what the windows ask of the hive.

Facts and commands are plain values, whether they come from topics, a file or a test. `DeskLink`
is the port through which both pass.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Protocol

from fleet_manager.client.reports import HiveMessage
from fleet_manager.client.traffic import ZoneCommand

if TYPE_CHECKING:
    from collections.abc import Sequence

    from blackboard.auction.decision import Decision
    from blackboard.domain.task import Task
    from fleet_manager.desk.places import Place
    from hive_common.grid_map import GridMap
    from hive_common.pose import Pose
    from hive_common.zone import Zone


@dataclass(frozen=True, slots=True)
class Clicked:
    """A point that a person chose on the map, in RViz or in the window."""

    pose: Pose  # the point [in `frame`]; its yaw counts only with `has_heading`
    frame: str  # the fixed frame of RViz; "map" from the window
    has_heading: bool  # True for a dragged arrow (2D Nav Goal), False for Publish Point


@dataclass(frozen=True, slots=True)
class MapBounds:
    """The edges of the map [m, map frame]."""

    x_min: float
    y_min: float
    x_max: float
    y_max: float


@dataclass(frozen=True, slots=True, eq=False)
class MapKnown:
    """The map of the building, also in coarser steps; see `desk.chart.levels_of`."""

    levels: tuple[GridMap, ...]  # the map itself, then each with half the cells a side

    @property
    def bounds(self) -> MapBounds:
        """Where the map ends."""
        return MapBounds(*self.levels[0].bounds)


@dataclass(frozen=True, slots=True)
class PlannedPath:
    """The path a robot is about to drive [m, map frame]; empty while it stands."""

    robot: str
    points: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class RobotPose:
    """The localized pose of a robot [map frame], more often than in its reports."""

    robot: str
    pose: Pose


class LinkState(Enum):
    """The state of the connection to the hive: to its ROS master, or over Zenoh."""

    SEARCHING = "searching"
    """Nobody has answered yet."""
    UP = "up"
    """Connected."""
    LOST = "lost"
    """Nobody answers any more. Over ROS, existing connections go on without the master."""


ROS_MASTER = "ROS master"
"""What a link connects to on ROS."""


@dataclass(frozen=True, slots=True)
class LinkChange:
    """What a link connects to came or went."""

    state: LinkState
    address: str
    what: str = ROS_MASTER


@dataclass(frozen=True, slots=True)
class PlacesKnown:
    """The named places of the world in which the hive works."""

    places: tuple[Place, ...]


@dataclass(frozen=True, slots=True)
class ZonesKnown:
    """The zones of the traffic planner; it tells on a topic which of them are closed."""

    zones: tuple[Zone, ...]


@dataclass(frozen=True, slots=True)
class DecisionRead:
    """A decision of an auction, from the files of a member of the hive on this machine."""

    decision: Decision


@dataclass(frozen=True, slots=True)
class TroublesRead:
    """What members and nodes of the hive say is wrong now, in sentences."""

    texts: tuple[str, ...]


Fact = (
    HiveMessage | Clicked | MapKnown | PlannedPath | RobotPose | PlacesKnown | ZonesKnown
    | LinkChange | DecisionRead | TroublesRead
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class PostTask:
    """Ask the hive to do a task."""

    task: Task


@dataclass(frozen=True, slots=True)
class CancelTask:
    """Ask the hive to cancel a task."""

    task_id: str


@dataclass(frozen=True, slots=True)
class SetRobotState:
    """Ask a robot to go out of service (`defect`), back into it (`idle`), or to `charge`."""

    robot: str
    word: str  # one of `blackboard.robot.service.WORDS`


@dataclass(frozen=True, slots=True)
class ReadDecisions:
    """Ask for the recorded auctions of a task; each is answered with a `DecisionRead`."""

    task_id: str


Request = PostTask | CancelTask | SetRobotState | ZoneCommand
"""What the hive is asked on its topics."""

Command = Request | ReadDecisions


class DeskLink(Protocol):
    """The port between the windows and the hive. No call ever waits for anything."""

    def start(self) -> None:
        """Begin to connect, in the background."""

    def stop(self) -> None:
        """Disconnect."""

    def now(self) -> float:
        """Return the hive's time [s]; 0 before it is known."""

    def drain(self, limit: int) -> Sequence[Fact]:
        """Return at most `limit` facts that have arrived since the last call, oldest first."""

    def send(self, command: Command) -> None:
        """Queue a command; it is sent as soon as the link allows."""
