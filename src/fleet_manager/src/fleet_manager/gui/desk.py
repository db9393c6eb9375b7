# SPDX-License-Identifier: BSD-3-Clause
"""What all windows of one program share: the hive's state, and what has been sent.

Facts from the hive are drained by a timer of the event loop, a few milliseconds at a time, so that
no flood of messages can hold the windows up.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

from python_qt_binding.QtCore import QObject, QTimer, Signal

from blackboard.consensus.messages import Heartbeat
from blackboard.domain.task import TaskState
from fleet_manager.desk.authority import Standing
from fleet_manager.desk.events import Log
from fleet_manager.desk.facts import (
    AskWhy,
    Clicked,
    LinkChange,
    LinkState,
    MapBounds,
    Moment,
    PlacesKnown,
    SetRobotState,
    Told,
)
from fleet_manager.desk.hive import Hive
from fleet_manager.desk.natural import next_task_id
from fleet_manager.desk.outbox import Outbox

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.domain.characteristics import RobotState
    from blackboard.domain.task import Task
    from fleet_manager.desk.facts import Fact, HiveLink
    from fleet_manager.desk.places import Place

DRAIN_PERIOD = 100  # [ms], about as quick as a person notices
TURN_PERIOD = 250  # [ms], for what depends on time alone
BUDGET = 0.010  # [s] of one drain, so that keys and mouse are served in between
BATCH = 20  # facts between two looks at the budget


class Desk(QObject):
    """The hive's state, kept up to date.

    Signals:
        changed: A `Changes`, at most once for each drain.
        clicked: A `Clicked`.
        letters_changed: Something that was sent has been answered.
        places_changed: The named places of the world are known.
        standing_changed: Who carries the blackboard, or the ROS master, came or went.

    Args:
        link: The way to the hive.

    Attributes:
        hive: What is known of the hive.
        outbox: What has been sent.
        places: The named places of the world.
        bounds: Where the map ends; None until a map is known.
        link_change: How the program stands with the ROS master.
    """

    changed = Signal(object)
    clicked = Signal(object)
    letters_changed = Signal()
    standing_changed = Signal()
    places_changed = Signal()

    def __init__(self, link: HiveLink) -> None:
        super().__init__()
        self.hive = Hive()
        self.outbox = Outbox(link.send)
        self.places: tuple[Place, ...] = ()
        self.bounds: MapBounds | None = None
        self.link_change = LinkChange(LinkState.SEARCHING, "")
        self._link = link
        self._standing: tuple[object, ...] = ()
        self._drain_timer = QTimer(self, interval=DRAIN_PERIOD, timeout=self._drain)
        self._turn_timer = QTimer(self, interval=TURN_PERIOD, timeout=self._turn)

    def start(self) -> None:
        """Begin to follow the hive."""
        self._link.start()
        self._drain_timer.start()
        self._turn_timer.start()

    def stop(self) -> None:
        """Follow it no longer."""
        self._drain_timer.stop()
        self._turn_timer.stop()
        self._link.stop()

    def moment(self) -> Moment:
        """Return the time on both clocks."""
        return Moment(self._link.now(), time.monotonic())

    def now(self) -> float:
        """Return the hive's time [s]."""
        return self._link.now()

    @property
    def standing(self) -> Standing:
        """Whether the hive has a blackboard now."""
        return self.hive.authority.standing(self.moment())

    def taken_ids(self) -> set[str]:
        """Return the ids that a new task cannot have."""
        rows = self.hive.tasks.items()
        listed = {name for name, row in rows if row.record.state is not TaskState.REJECTED}
        return listed | {letter.task.id for letter in self.outbox.letters if letter.is_open}

    def proposed_id(self) -> str:
        """Return a free id for a new task."""
        letters = (letter.task.id for letter in self.outbox.letters)
        return next_task_id({*self.hive.tasks, *letters})

    def post(self, task: Task) -> None:
        """Send a task; it is kept until the hive has answered."""
        task = replace(task, posted=self.now())
        self.hive.apply(Told(task, task.posted), self.moment())
        self.outbox.post(task)
        self._turn()
        self.letters_changed.emit()

    def cancel(self, task_ids: Iterable[str]) -> None:
        """Ask the hive to take tasks off its list."""
        for task_id in task_ids:
            self.outbox.cancel(task_id)
            self.hive.note(Log().asked_cancel(task_id))
        self._turn()

    def send_again(self, task_ids: Iterable[str]) -> None:
        """Post the same as some tasks under new ids."""
        for task_id in task_ids:
            if task := self.hive.posted(task_id):
                self.post(replace(task, id=self.proposed_id()))

    def ask_why(self, task_id: str) -> None:
        """Have the bids on a task looked up, for where they are not told on any topic."""
        self._link.send(AskWhy(task_id))

    def set_robot_state(self, robots: Iterable[str], state: RobotState) -> None:
        """Ask robots to go out of service or back into it."""
        for robot in robots:
            self._link.send(SetRobotState(robot, state))
            self.hive.note(Log().asked_state(robot, state))
        self._tell_changes()

    def _drain(self) -> None:
        """Take in what has arrived, for as long as the budget lasts."""
        moment, end = self.moment(), time.monotonic() + BUDGET
        heard = False
        while time.monotonic() < end:
            facts = self._link.drain(BATCH)
            for fact in facts:
                heard |= self._take(fact, moment)
            if len(facts) < BATCH:
                break
        if heard:
            self.letters_changed.emit()
        self._tell_changes()

    def _take(self, fact: Fact, moment: Moment) -> bool:
        """Take one fact in, and return whether it answers something that was sent."""
        self.hive.apply(fact, moment)
        if isinstance(fact, Clicked):
            self.clicked.emit(fact)
        elif isinstance(fact, MapBounds):
            self.bounds = fact
        elif isinstance(fact, LinkChange):
            self.link_change = fact
        elif isinstance(fact, PlacesKnown):
            self.places = fact.places
            self.places_changed.emit()
        if isinstance(fact, LinkChange) or _is_heartbeat(fact):
            self._tell_standing()
        return self.outbox.hear(fact, self.hive.record)

    def _turn(self) -> None:
        """Do what depends on time alone."""
        moment = self.moment()
        self.hive.tick(moment)
        someone = self.hive.authority.standing(moment) is Standing.LEADER
        if self.outbox.tick(moment, someone_listens=someone):
            self.letters_changed.emit()
        self._tell_standing()
        self._tell_changes()

    def _tell_standing(self) -> None:
        """Say so when what the banner shows is no longer true."""
        beat, standing = self.hive.authority.heartbeat, self.standing
        silence = int(self.hive.authority.silence(self.moment()))
        who = (beat.leader, beat.backup, beat.epoch) if beat else ()
        shown = (standing, who, self.link_change, standing is Standing.SILENT and silence)
        if shown != self._standing:
            self._standing = shown
            self.standing_changed.emit()

    def _tell_changes(self) -> None:
        changes = self.hive.take_changes()
        if changes.tasks or changes.robots or changes.events:
            self.changed.emit(changes)


def _is_heartbeat(fact: Fact) -> bool:
    return isinstance(fact, Told) and isinstance(fact.report, Heartbeat)
