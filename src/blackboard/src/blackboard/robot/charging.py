# SPDX-License-Identifier: BSD-3-Clause
"""Sends a robot to a charger in time, and back to work once it has charged enough.

No two robots drive to one charger: a robot asks for a charger in its status, the leader gives it
away as a change of the task list, and the robot drives there once its member's list shows that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum, auto
from functools import partial
from typing import TYPE_CHECKING

from blackboard.consensus.journal import MemoryJournal
from blackboard.costing.effort import charge_to_reach
from blackboard.domain.characteristics import RobotState
from blackboard.domain.charger import Grant
from blackboard.domain.settings import ChargingSettings
from blackboard.domain.task import Task, TaskType
from blackboard.errors import JournalError
from blackboard.robot.executor import CommandState
from hive_common.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from blackboard.consensus.journal import Journal
    from blackboard.consensus.task_list import TaskList
    from blackboard.costing.experience import Experience
    from blackboard.domain.battery import Battery
    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.talker import Talker
    from blackboard.robot.executor import CommandResult, Controller
    from blackboard.robot.lease_keeper import LeaseKeeper
    from blackboard.robot.service import Service

NEAR = 1.0
"""A robot that is this close to a charger is in the way of others there [m]."""

_STOPPING_TIME = 1.0
"""A robot that stops has braked, and knows where it stands, after this long [s]."""

_AVOID = 30.0
"""A robot that found no path to a place does not try it again for this long [s]."""

_ASIDE = (3.0, 5.0, 2.0)
"""How far from a charger a robot goes that has no other place to go, the best first [m]."""

_CLEAR = 1.5
"""It keeps at least this far from all chargers [m]."""

_DIRECTIONS = 12
"""In how many directions it looks for such a place."""


def _ring(center: Pose, radius: float) -> Iterator[Pose]:
    """Yield places all around another one at a distance [m]."""
    for number in range(_DIRECTIONS):
        angle = math.tau * number / _DIRECTIONS
        yield Pose(center.x + radius * math.cos(angle), center.y + radius * math.sin(angle))


@dataclass(frozen=True)
class ChargingPlan:
    """Where a fleet's robots charge, and when."""

    # Where a robot stands at each charger, by name [map frame]; without chargers, robots charge
    # only where a person sets them to.
    chargers: Mapping[str, Pose] = field(default_factory=dict)
    settings: ChargingSettings = field(default_factory=ChargingSettings)  # the thresholds


class Phase(Enum):
    """Where a robot is between work and charger."""

    AWAY = auto()  # it needs no charger, or waits until one is given to it
    GOING = auto()  # it drives to a charger
    STOPPING = auto()  # it has stopped on its way, and keeps the charger until it stands
    THERE = auto()  # it charges
    # It drives back to where it started, or aside, so that the charger is free for others.
    LEAVING = auto()


class Charging:
    """Decides when one robot charges, and where.

    Attributes:
        charger: The charger that it asks for, drives to or stands at; empty for none.
        is_at_charger: Whether it stands there.
        since: Since when it says so, by its date [s]. What it says later has a later time.

    Args:
        service: Told when it leaves service to charge, and when it comes back.
        plan: Where and when it charges; by default only where a person sets it to.
        experience: Tells what the drive to a charger draws; the formula by default.
        journal: Keeps where it goes when it is full; by default nothing does.
    """

    def __init__(
        self,
        talker: Talker,
        robot_id: str,
        body: RobotCharacteristics,
        battery: Battery,
        path_lengths: PathLengths,
        controller: Controller,
        service: Service,
        plan: ChargingPlan | None = None,
        experience: Experience | None = None,
        journal: Journal | None = None,
    ) -> None:
        self._talker = talker
        self._journal = journal or MemoryJournal()
        self._id = robot_id
        self._body = body
        self._battery = battery
        self._path_lengths = path_lengths
        self._controller = controller
        self._service = service
        self._plan = plan = plan or ChargingPlan()
        self._experience = experience
        self.charger = ""
        self.is_at_charger = False
        self.since = 0.0
        self._grants: Mapping[str, Grant] = {}
        self._phase = Phase.AWAY
        self._is_sent = False
        self._avoided: dict[Pose, float] = {}
        self._pose: Pose | None = None

    def start(
        self,
        pose: Pose,
        lease: LeaseKeeper,
        changed: Callable[[], None],
        tell: Callable[[], None],
    ) -> None:
        """Begin to decide.

        Args:
            pose: Where the robot is now, and where it goes when it is full, unless it starts at a
                charger and knows another place from before [map frame].
            lease: The robot drives only while it holds.
            changed: Called when there is something new to consider.
            tell: Called when the status says something else about chargers than before.
        """
        self._pose = self._home = pose
        self._lease, self._changed, self._tell = lease, changed, tell
        self.since = self._talker.date()
        if not self._plan.chargers:
            return
        at = next((name for name in self._plan.chargers if self._is_at(name)), None)
        if at is None:
            self._keep_home(pose)
        else:
            self._home = self._journal.load_home() or pose
            self._phase = Phase.THERE
            self._say(at, is_there=True)
            if self._battery.level < self._plan.settings.enough:
                self._leave_service(f"charges at {at}")

    def _keep_home(self, home: Pose) -> None:
        """Write down where the robot goes when it is full: it may be restarted at a charger."""
        if self._journal.load_home() == home:
            return
        try:
            self._journal.save_home(home)
        except JournalError as error:
            what = "if it restarts at a charger, it stays there when it is full"
            self._talker.warn(f"{self._id} may forget where it comes from: {what}: {error}")

    def hear(self, known: TaskList) -> None:
        """Take in which robot has which charger; the robot drives to none that is not its own."""
        self._grants = {each.charger: each for each in known.grants}
        latest = max((each.since for each in known.grants if each.robot == self._id), default=0.0)
        if latest > self.since:  # Its date was set back.
            self.since = latest
            self._renew()
        if self._phase is Phase.GOING and not self._is_given:
            self._halt()
        if self.charger not in {"", *self._free}:
            if self._phase is not Phase.LEAVING:
                self._phase = Phase.AWAY
            self._say("")

    @property
    def is_charging(self) -> bool:
        """Whether it is at a charger, or where a person set it to charge."""
        by_hand = self._service.state is RobotState.CHARGING and not self._service.is_on_its_own
        stands = not self.charger and not self._controller.task_id
        return self._phase is Phase.THERE or (by_hand and stands)

    @property
    def places(self) -> tuple[Pose, ...]:
        """Where the chargers are [map frame]."""
        return tuple(self._plan.chargers.values())

    @property
    def refusal(self) -> str:
        """Why it takes no new task; empty if it does."""
        if self._service.reason:
            return self._service.reason
        if self._is_sent:
            return "an operator has sent it to charge"
        if self._plan.chargers and self._is_critical and self._phase is not Phase.THERE:
            return f"its battery is at {self._battery.level:.0%}: it charges next"
        return ""

    def reserve(self, end: Pose) -> float:
        """Return the charge that it has to keep to reach a charger from a pose [Ah]."""
        return charge_to_reach(
            self.places, end, self._body, self._path_lengths, self._battery, self._experience
        )

    def note_pose(self, pose: Pose) -> None:
        """Note where it is; a charger that it has left is free for others."""
        self._pose = pose
        if self.is_at_charger and not self._is_at(self.charger):
            self._say("")
            if self._phase is Phase.THERE:
                self._phase = Phase.AWAY

    def pass_time(self, period: float) -> None:
        """Draw what being switched on for a time [s] takes, and charge if it is charging."""
        self._battery.update_level(self._body.idle_power * period)
        if self.is_charging:
            self._battery.charge(period)
            if self._service.state is RobotState.CHARGING and self._battery.level >= self._enough:
                self._service.be_charged()
                self._is_sent = False
        if self._battery.level <= 0.0:
            self.abandon()
            self._service.strand(f"stranded at {self._pose}: its battery is empty")

    def consider(self, *, idle: bool, loaded: bool) -> None:
        """Decide what to do about the battery now.

        An `idle` robot's schedule is empty; a `loaded` one's arm has a load to put down.
        """
        if not self._plan.chargers:
            return
        if self._service.state is RobotState.DEFECT:
            if self._phase is Phase.AWAY:
                self._say("")
            return
        at_work = not idle
        on_its_way = self._phase in {Phase.GOING, Phase.LEAVING}
        if on_its_way and not self._lease.holds():
            self._halt()
        elif self._phase is Phase.GOING and at_work:
            self._halt()  # the new task may have stopped the drive
        elif self._phase is Phase.LEAVING and at_work:
            self._phase = self._phase_here()
        elif self._phase is Phase.AWAY and self._needs_charger(idle=idle, loaded=loaded):
            self._seek(idle=idle)
        elif self._phase is Phase.AWAY:
            self._say("")
        elif self._phase is Phase.THERE and idle and self._may_leave:
            self._make_room()

    def send(self) -> str:
        """Go to a charger once nothing is on board, and charge until full: an operator says so.

        Returns:
            Why it cannot; empty if it goes, or is there.
        """
        if not self._plan.chargers:
            return "the fleet has no chargers; name them in its world or its fleet file"
        if self._service.state is RobotState.DEFECT or self._service.left_on_board is not None:
            return f"it is out of service: {self._service.reason}"
        if self._phase is Phase.LEAVING:
            self._halt()
        if self._phase is Phase.THERE:
            self._leave_service(f"charges at {self.charger}")
        self._is_sent = True
        return ""

    def abandon(self) -> None:
        """Stop on the way to or from a charger, because a person has decided otherwise."""
        self._is_sent = False
        if self._phase in {Phase.GOING, Phase.LEAVING}:
            self._halt()

    @property
    def _is_critical(self) -> bool:
        return self._battery.level < self._plan.settings.critical

    @property
    def _enough(self) -> float:
        """The level at which it takes tasks again."""
        if self._phase is not Phase.THERE:
            return 1.0
        settings = self._plan.settings
        return settings.full if self._is_sent else settings.enough

    @property
    def _may_leave(self) -> bool:
        """Whether it is full, or has enough while another waits, and nothing keeps it there."""
        settings = self._plan.settings
        needed = settings.enough if self._lease.makes_room else settings.full
        return self._service.state is None and self._battery.level >= needed

    def _needs_charger(self, *, idle: bool, loaded: bool) -> bool:
        if loaded:
            return False
        if self._service.is_on_its_own or self._is_sent:
            return True
        is_low = self._is_critical or (idle and self._battery.level < self._plan.settings.low)
        return is_low and self._service.state is None

    def _seek(self, *, idle: bool) -> None:
        """Ask for the nearest free charger, and go once it is this robot's.

        Without its lease it asks for none, and anew when the lease is back: the hive may have
        given the charger to another robot in the meantime, and its list may not show that yet.
        """
        if self._is_critical or self._is_sent:
            self._leave_service(self._what_it_waits_for())
        if not self._lease.holds():
            self._say("")
        elif not self.charger:
            self._say(self._nearest() or "")
        elif self._is_given and idle:
            self._phase = Phase.GOING
            self._leave_service(f"goes to {self.charger}")
            self._drive(self._plan.chargers[self.charger], self._arrived)

    def _what_it_waits_for(self) -> str:
        if self._free:
            return "seeks a free charger"
        taken = (f"{self._grants[name].robot} has {name}" for name in self._plan.chargers)
        return f"waits for a charger: {', '.join(taken)}"

    def _say(self, charger: str, *, is_there: bool = False) -> None:
        """Ask for a charger, say that it is there, or give up the one that it asked for or has."""
        if (charger, is_there) != (self.charger, self.is_at_charger):
            self.charger, self.is_at_charger = charger, is_there
            self._renew()

    def _renew(self) -> None:
        """Say it as something new, which no grant from before answers."""
        self.since = max(self._talker.date(), math.nextafter(self.since, math.inf))
        self._tell()

    @property
    def _is_given(self) -> bool:
        """Whether the list shows a grant that answers what the robot says now."""
        given = self._grants.get(self.charger)
        return given == Grant(self.charger, self._id, self.since)

    @property
    def _free(self) -> tuple[str, ...]:
        """The chargers that no other robot has."""
        others = {name for name, given in self._grants.items() if given.robot != self._id}
        return tuple(name for name in self._plan.chargers if name not in others)

    def _nearest(self) -> str | None:
        """Return the free charger with the shortest path; None if none can be reached."""
        here = self._pose
        assert here is not None  # noqa: S101  (set by `start`)
        lengths = {
            name: self._path_lengths.length(here, self._plan.chargers[name])
            for name in self._free
            if not self._is_avoided(self._plan.chargers[name])
        }
        reachable = [name for name in lengths if math.isfinite(lengths[name])]
        return min(reachable, key=lambda name: lengths[name], default=None)

    def _arrived(self, result: CommandResult) -> None:
        charger = self.charger
        if result.state is CommandState.SUCCEEDED:
            self._phase = Phase.THERE
            self._leave_service(f"charges at {charger}")
            self._say(charger, is_there=True)
        else:
            self._phase = Phase.AWAY
            self._avoid(self._plan.chargers[charger])
            self._say("")
        self._changed()

    def _make_room(self) -> None:
        """Drive home from the charger; if that is its home, aside, but only for another robot."""
        place = self._plan.chargers[self.charger]
        can_go_home = self._home.distance_to(place) > NEAR and not self._is_avoided(self._home)
        goal = self._home if can_go_home else None
        if goal is None and self._lease.makes_room:
            goal = self._aside(place)
        if goal is not None and self._lease.holds():
            self._phase = Phase.LEAVING
            self._drive(goal, partial(self._left, goal))

    def _aside(self, charger: Pose) -> Pose | None:
        """Return the nearest place that is in the way at no charger; None if none is reached."""
        for radius in _ASIDE:
            lengths = {
                # The way to the charger, because one search finds all of those.
                self._path_lengths.length(goal, charger): goal
                for goal in _ring(charger, radius)
                if all(goal.distance_to(each) > _CLEAR for each in self.places)
                if not self._is_avoided(goal)
            }
            if lengths and math.isfinite(min(lengths)):
                return lengths[min(lengths)]
        return None

    def _left(self, goal: Pose, result: CommandResult) -> None:
        if result.state is not CommandState.SUCCEEDED:
            self._avoid(goal)
        self._phase = self._phase_here()

    def _avoid(self, goal: Pose) -> None:
        self._avoided[goal] = self._talker.world.now() + _AVOID

    def _is_avoided(self, goal: Pose) -> bool:
        return self._avoided.get(goal, -math.inf) > self._talker.world.now()

    def _phase_here(self) -> Phase:
        return Phase.THERE if self._is_at(self.charger) else Phase.AWAY

    def _drive(self, goal: Pose, ended: Callable[[CommandResult], None]) -> None:
        task = Task(f"{self._id} charging", TaskType.GA, (goal,))
        self._controller.run(task, 0, lambda _: None, ended)

    def _halt(self) -> None:
        """Stop on the way; the robot asks for the charger anew before it goes on."""
        self._controller.stop()
        if self._phase is Phase.LEAVING:
            self._stay()
            return
        self._phase = Phase.STOPPING
        self._talker.after(_STOPPING_TIME, self._stopped)

    def _stopped(self) -> None:
        if self._phase is Phase.STOPPING:
            self._stay()
            self._changed()

    def _stay(self) -> None:
        """Keep the charger if the robot stands at it, and give it up otherwise."""
        self._phase = self._phase_here()
        is_there = self._phase is Phase.THERE
        self._say(self.charger if is_there else "", is_there=is_there)

    def _leave_service(self, doing: str) -> None:
        self._service.go_charging(f"its battery is at {self._battery.level:.0%}: {doing}")

    def _is_at(self, charger: str) -> bool:
        place, here = self._plan.chargers.get(charger), self._pose
        return place is not None and here is not None and here.distance_to(place) <= NEAR
