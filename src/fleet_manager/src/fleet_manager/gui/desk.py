# SPDX-License-Identifier: BSD-3-Clause
"""What all windows of one program share: the hive's state, and the requests to the hive.

A timer of the event loop drains the facts from the hive, a few milliseconds at a time, so that no
flood of messages can stall the windows.
"""

from __future__ import annotations

import secrets
import time
from dataclasses import replace
from typing import TYPE_CHECKING

from python_qt_binding.QtCore import QObject, QTimer, Signal

from blackboard.consensus.messages import Heartbeat
from blackboard.robot.service import put_down_word
from fleet_manager.client.hive_state import HiveState
from fleet_manager.client.leadership import Standing
from fleet_manager.client.reports import HiveMessage
from fleet_manager.client.task_ids import next_task_id
from fleet_manager.client.traffic import ZoneCommand
from fleet_manager.client.words import Event, Severity
from fleet_manager.desk.facts import (
    Clicked,
    DecisionRead,
    LinkChange,
    LinkState,
    MapBounds,
    MapKnown,
    PlacesKnown,
    PlannedPath,
    ReadDecisions,
    RobotPose,
    SetRobotState,
    TroublesRead,
    ZonesKnown,
)
from fleet_manager.desk.requests import RequestQueue

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.domain.task import Task
    from fleet_manager.desk.facts import DeskLink, Fact
    from fleet_manager.desk.places import Place
    from hive_common.pose import Pose
    from hive_common.zone import Zone

DRAIN_PERIOD = 100  # [ms], about as quick as a person notices
TICK_PERIOD = 250  # [ms], for what depends on time alone
BUDGET = 0.010  # [s] of one drain, so that keys and mouse are served in between
BATCH = 20  # facts between two looks at the budget


class Desk(QObject):
    """The hive's state, kept up to date.

    Signals:
        changed: A `Changes`, at most once for each drain.
        clicked: A `Clicked`.
        sent_tasks_changed: A task that was sent has been answered.
        places_changed: The named places of the world are known.
        map_changed: The map, the zones, or where robots are and drive, at most once for each
            drain.
        standing_changed: The leader or the ROS master came or went.

    Args:
        link: The link to the hive.
    """

    changed = Signal(object)
    clicked = Signal(object)
    sent_tasks_changed = Signal()
    standing_changed = Signal()
    places_changed = Signal()
    map_changed = Signal()

    def __init__(self, link: DeskLink) -> None:
        super().__init__()
        self.hive = HiveState(detailed=True)  # what is known of the hive
        self.requests = RequestQueue(link.send)  # what has been sent
        self.places: tuple[Place, ...] = ()  # the named places of the world
        self.map: MapKnown | None = None  # None until a map is known
        self.zones: tuple[Zone, ...] = ()  # in which the traffic planner limits robots
        self.paths: dict[str, PlannedPath] = {}  # by robot
        self.poses: dict[str, Pose] = {}  # by robot [map frame], newer than in its reports
        self.link_change = LinkChange(LinkState.SEARCHING, "")  # the link to the hive
        self.troubles: tuple[str, ...] = ()  # what members and nodes say is wrong
        self._link = link
        self._name = secrets.token_hex(8)  # as the poster of tasks
        self._standing: tuple[object, ...] = ()
        self._map_changed = False
        self._drain_timer = QTimer(self, interval=DRAIN_PERIOD, timeout=self._drain)
        self._tick_timer = QTimer(self, interval=TICK_PERIOD, timeout=self._tick)

    def start(self) -> None:
        """Start following the hive."""
        self._link.start()
        self._drain_timer.start()
        self._tick_timer.start()

    def stop(self) -> None:
        """Stop following the hive."""
        self._drain_timer.stop()
        self._tick_timer.stop()
        self._link.stop()

    def now(self) -> float:
        """Return the hive's time [s]."""
        return self._link.now()

    @property
    def bounds(self) -> MapBounds | None:
        """The edges of the map; None until a map is known."""
        return self.map.bounds if self.map else None

    @property
    def standing(self) -> Standing:
        """Whether the hive has a blackboard now."""
        return self.hive.leadership.standing(time.monotonic())

    def taken_ids(self) -> set[str]:
        """Return the ids that a new task cannot have."""
        sent = {sent.task.id for sent in self.requests.sent_tasks if sent.is_open}
        return sent.union(self.hive.records)

    def proposed_id(self) -> str:
        """Return a free id for a new task."""
        sent = (sent.task.id for sent in self.requests.sent_tasks)
        return next_task_id({*self.hive.tasks, *sent})

    def post(self, task: Task) -> None:
        """Send a task, repeatedly until the hive answers."""
        task = replace(task, posted=self.now(), poster=self._name)
        self.hive.take_in(task, time.monotonic(), task.posted)
        self.requests.post(task)
        self._tick()
        self.sent_tasks_changed.emit()

    def cancel(self, task_ids: Iterable[str]) -> None:
        """Ask the hive to cancel tasks."""
        for task_id in task_ids:
            self.requests.cancel(task_id)
            self.hive.note(Event(f"asked the hive to cancel task {task_id}", task_id=task_id))
        self._tick()

    def switch_zone(self, name: str, *, closed: bool) -> None:
        """Ask the traffic planner to close a zone, or to open it."""
        self.requests.switch(ZoneCommand(name, closed))
        verb = "close" if closed else "open"
        self.hive.note(Event(f"asked the traffic planner to {verb} zone {name}"))
        self._tick()

    def send_again(self, task_ids: Iterable[str]) -> None:
        """Post copies of tasks under new ids."""
        for task_id in task_ids:
            if task := self.hive.posted(task_id):
                self.post(replace(task, id=self.proposed_id()))

    def read_decisions(self, task_id: str) -> None:
        """Have the recorded bids on a task read, for those that were not heard on a topic."""
        self._link.send(ReadDecisions(task_id))

    def put_in_service(self, robots: Iterable[str], *, into: bool) -> None:
        """Ask robots to go back into service, or out of it."""
        for robot in robots:
            self._link.send(SetRobotState(robot, "idle" if into else "defect"))
            where = "back into service" if into else "out of service"
            self.hive.note(Event(f"asked {robot} to go {where}"))
        self._tell_changes()

    def put_down(self, robot: str, name: str, place: Pose) -> None:
        """Ask a robot to put the load that was left on board down at a place of a name."""
        self._link.send(SetRobotState(robot, put_down_word(place)))
        self.hive.note(Event(f"asked {robot} to put its load down at {name}"))
        self._tell_changes()

    def _drain(self) -> None:
        """Take in what has arrived, within the budget."""
        now = time.monotonic()
        end = now + BUDGET
        heard = False
        while time.monotonic() < end:
            facts = self._link.drain(BATCH)
            for fact in facts:
                heard |= self._take(fact, now)
            if len(facts) < BATCH:
                break
        if heard:
            self.sent_tasks_changed.emit()
        self._tell_changes()
        if self._map_changed:
            self._map_changed = False
            self.map_changed.emit()

    def _take(self, fact: Fact, now: float) -> bool:
        """Take in one fact, and return whether it answers something that was sent."""
        if isinstance(fact, HiveMessage):
            self.hive.take_in(fact.report, now, fact.stamp)
            if isinstance(fact.report, Heartbeat):
                self._tell_standing()
        elif isinstance(fact, DecisionRead):
            self.hive.add_bids(fact.decision)
        elif isinstance(fact, Clicked):
            self.clicked.emit(fact)
        elif isinstance(fact, MapKnown | ZonesKnown | PlannedPath | RobotPose):
            self._take_drawn(fact)
        elif isinstance(fact, LinkChange):
            self._take_link_change(fact)
        elif isinstance(fact, TroublesRead):
            self.troubles = fact.texts
            self._tell_standing()
        elif isinstance(fact, PlacesKnown):
            self.places = fact.places
            self.places_changed.emit()
        return self.requests.hear(fact, self.hive.record)

    def _take_drawn(self, fact: MapKnown | ZonesKnown | PlannedPath | RobotPose) -> None:
        """Take in what only the map shows."""
        self._map_changed = True
        if isinstance(fact, MapKnown):
            self.map = fact
        elif isinstance(fact, ZonesKnown):
            self.zones = fact.zones
        elif isinstance(fact, PlannedPath):
            self.paths[fact.robot] = fact
        else:
            self.poses[fact.robot] = fact.pose

    def _take_link_change(self, change: LinkChange) -> None:
        self.link_change = change
        if change.state is LinkState.UP:
            self.hive.note(Event(f"connected to the {change.what} at {change.address}"))
        elif change.state is LinkState.LOST:
            text = f"the {change.what} at {change.address} does not answer"
            self.hive.note(Event(text, Severity.WARNING))
        self._tell_standing()

    def _tick(self) -> None:
        """Do what depends on time alone."""
        now = time.monotonic()
        self.hive.tick(now)
        someone = self.hive.leadership.standing(now) is Standing.LEADER
        if self.requests.tick(now, someone_listens=someone):
            self.sent_tasks_changed.emit()
        self._tell_standing()
        self._tell_changes()

    def _tell_standing(self) -> None:
        """Emit `standing_changed` when the banner is out of date."""
        beat, standing = self.hive.heartbeat, self.standing
        silence = int(self.hive.leadership.silence(time.monotonic()))
        who = (beat.leader, beat.backup, beat.epoch) if beat else ()
        shown = (
            *(standing, who, self.link_change, self.troubles),
            standing is Standing.SILENT and silence,
        )
        if shown != self._standing:
            self._standing = shown
            self.standing_changed.emit()

    def _tell_changes(self) -> None:
        changes = self.hive.take_changes()
        if changes.tasks or changes.robots or changes.events:
            self.changed.emit(changes)
