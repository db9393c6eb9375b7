# SPDX-License-Identifier: BSD-3-Clause
"""How a program outside the hive posts tasks and follows them.

ROS loses what is published right after a publisher was made, and the leader may be changing at
that moment. So every request is repeated, with the same id, until the blackboard answers; posting
the same task twice is harmless.
"""

from __future__ import annotations

import contextlib
import secrets
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

from blackboard.domain import talker as topics
from blackboard.domain.characteristics import RobotState
from blackboard.domain.record import TaskUpdate
from blackboard.domain.task import MAX_ID_LENGTH, TaskState, check_id
from blackboard.errors import TaskRefusedError
from blackboard.robot.service import PUT_DOWN
from fleet_manager.client.formats import member, natural
from fleet_manager.client.hive_state import HiveState
from fleet_manager.client.leadership import SILENCE, Standing
from fleet_manager.client.task_ids import next_task_id
from fleet_manager.client.topics import TRAFFIC_STATE
from fleet_manager.client.traffic import ZoneCommand
from fleet_manager.errors import InputError, NoHiveError, NotDoneError, TimeUpError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from pathlib import Path

    from blackboard.domain.record import TaskRecord
    from blackboard.domain.task import Task
    from fleet_manager.client.reports import HiveMessage, Report
    from fleet_manager.client.rows import RobotRow
    from fleet_manager.client.traffic import TrafficState
    from fleet_manager.client.words import Event
    from fleet_manager.config.scenario import PlannedTask
    from hive_common.map_id import MapId
    from hive_common.pose import Pose

DEFAULT_URI = "http://localhost:11311"
"""Address of the ROS master that catkin's setup.bash sets; counts as not given by the user."""

REPEAT_EVERY = 0.5  # time between two publications of the same request [s]

ANSWER_WITHIN = 6.0
"""Time for the blackboard's answer [s]; longer than a takeover with its 2 s of silence."""

LISTED_WITHIN = 0.5
"""Time in which a task that was taken in is on the published list, `sync_period` included [s]."""

STATUS_PERIOD = 1.5
"""A robot that the hive does not name yet reports within this time [s]: statuses come at 1 Hz, by
the robot's own clock."""

CLOCK_WITHIN = 6.0
"""Time in which a simulator tells its time [s, wall], if there is one."""

NEW_MAP_WITHIN = 180.0
"""Time in which every robot plans on a new map [s]: robots of four sizes that share a process take
more than a minute for 4,000 x 4,000 cells."""

_MOST_IDS = 20  # ids that are tried where others take them at the same moment
_PAUSE = 1.0  # time in which everything is read that has come meanwhile [s]
_AT_ONCE = 1.0  # time in which what is latched arrives unless something is wrong [s]


def id_of(known: TaskUpdate | TaskRecord) -> str:
    """Return the id of the task that an answer is about."""
    return known.task_id if isinstance(known, TaskUpdate) else known.task.id


class ClientLink(Protocol):
    """The port between a client and the hive's topics, for use by one thread."""

    def now(self) -> float:
        """Return a monotonic time [s]."""

    def hive_time(self, within: float = 0.0) -> float:
        """Return the hive's time [s], which may be simulated; 0 while it is unknown.

        It is waited for as long as `within` [s, wall].
        """

    def listen(self, *names: str) -> None:
        """Follow some of the hive's topics from now on; all of its state if none is named."""

    def has_heard_robots(self) -> bool:
        """Return whether every robot that is there has told its status."""

    def troubles(self) -> Sequence[str]:
        """Return what members and nodes of the hive say is wrong, after listening for a while."""

    def post(self, task: Task) -> None:
        """Publish a task on `new_task`, once."""

    def cancel(self, task_id: str) -> None:
        """Publish a task's id on `task_cancel`, once."""

    def switch(self, command: ZoneCommand) -> None:
        """Publish a command on `zone_command`, once."""

    def set_state(self, robot: str, word: str) -> None:
        """Publish a word on a robot's `set_state`, once."""

    def places(self) -> Mapping[str, Pose]:
        """Return the named places of the hive's building [map frame]."""

    def radius_of(self, robot: str) -> float | None:
        """Return how close a robot's middle may come to what is blocked [m]; None if unknown."""

    def learned_of(self, robot: str) -> object:
        """Return what a robot's parameter `learned` holds; see `SavedExperience`.

        It may hold anything, and is None where the robot has no such parameter.

        Raises:
            NoHiveError: Nobody answers who would know.
        """

    def change_map(self, path: Path) -> None:
        """Have the map server read a file.

        Raises:
            NoHiveError: No map server answers that can do so.
            NotDoneError: It cannot use the file.
        """

    def receive(self, timeout: float) -> HiveMessage | None:
        """Return the next report, or None after `timeout` [s]."""


class HiveClient:
    """Posts and cancels tasks, and follows what becomes of them.

    `on_report` is called with each report and the events that it tells, and with None and the
    events when something has fallen silent.
    """

    def __init__(
        self,
        link: ClientLink,
        on_report: Callable[[Report | None, Sequence[Event]], None] = lambda _report, _events: (
            None
        ),
    ) -> None:
        self.state = HiveState()  # what the hive has said so far
        self.link = link
        self._on_report = on_report
        self._name = secrets.token_hex(8)  # as the poster of tasks
        self._looked = self._ticked = link.now()

    def pump(self, until: Callable[[], bool], timeout: float | None) -> bool:
        """Take in reports until a condition holds; return whether it held within `timeout` [s].

        The condition is checked before the first report and after each. None sets no time limit.
        """
        self.link.listen()
        return self._pump(until, timeout)

    def _pump(self, until: Callable[[], bool], timeout: float | None) -> bool:
        """Do the same on the topics that the link listens to already."""
        end = None if timeout is None else self.link.now() + timeout
        while not until():
            left = REPEAT_EVERY if end is None else end - self.link.now()
            if left <= 0:
                return False
            message = self.link.receive(min(left, REPEAT_EVERY))
            now = self.link.now()
            if message is not None:
                self.state.take_in(message.report, now, message.stamp)
            self._tick(now)
            events = self.state.take_changes().events
            if message is not None or events:
                self._on_report(message.report if message else None, events)
        return True

    def _tick(self, now: float) -> None:
        """Notice who has fallen silent, unless the news of a pause may still be in the queue."""
        if now - self._looked > _PAUSE:
            self._ticked = now
        self._looked = now
        if now - self._ticked > _PAUSE:
            self._ticked = now
            self.state.tick(now)

    def submit(self, task: Task) -> TaskUpdate | TaskRecord:
        """Post a task; return the blackboard's first word, even REJECTED.

        Raises:
            InputError: The id is none.
            NoHiveError: No blackboard answered.
            NotDoneError: The id is on the task list already, for another task.
        """
        return self.submit_all([task])[0]

    def submit_all(self, tasks: Sequence[Task]) -> list[TaskUpdate | TaskRecord]:
        """Post several tasks in a row; return the answers in their order, as `submit` does."""
        for task in tasks:
            try:
                check_id(task.id)
            except TaskRefusedError as error:
                raise InputError(f"task {task.id[:MAX_ID_LENGTH]}: {error}") from None
        self.link.listen(topics.TASK_STATE, topics.SYNC)
        for task in tasks:
            self._post(task)
        # An answer names the id only. It may be meant for a task that another program posts under
        # that id at the same moment; the list tells which of the two is on it.
        ids = {task.id for task in tasks}
        self._pump(lambda: ids <= self.state.listed.keys(), LISTED_WITHIN)
        return [self._answer_to(task) for task in tasks]

    def submit_numbered(self, task: Task) -> TaskUpdate | TaskRecord:
        """Post a task under the next free id of the series T1, T2, ...; return the answer.

        Another program may choose the same id at the same moment, even for the same content. The
        blackboard takes the one that it hears first; the other tries the next id.

        Raises:
            NoHiveError: No blackboard answered.
            NotDoneError: Others have taken every id that was tried.
        """
        self.fetch_tasks()
        tried: set[str] = set()
        for _ in range(_MOST_IDS):
            name = next_task_id({*self.state.tasks, *tried})
            tried.add(name)
            with contextlib.suppress(NotDoneError):
                return self.submit(replace(task, id=name, poster=self._name))
        raise NotDoneError(f"{_MOST_IDS} ids were taken by other programs; choose one with --id")

    def _post(self, task: Task) -> None:
        # Without a clock the blackboard stamps it.
        task = replace(task, posted=self.link.hive_time())
        self._repeat(
            lambda: self.link.post(task), lambda: self.state.state_of(task.id) is not None
        )
        if self.state.last_word(task.id) is None:
            raise self._no_answer(f"task {task.id} may not be on the list")

    def _answer_to(self, task: Task) -> TaskUpdate | TaskRecord:
        record = self.state.listed.get(task.id)
        if record is not None and not record.task.asks_the_same_as(task):
            raise NotDoneError(f"task id {task.id} is taken by another task; choose another id")
        said = self.state.last_word(task.id)
        if said is None:  # it was heard, and has left the picture since
            raise self._no_answer(f"task {task.id} may not be on the list")
        return said

    def cancel(self, task_id: str) -> None:
        """Take a task off the task list.

        Raises:
            NoHiveError: No blackboard answered.
            NotDoneError: There is no such task, or it has ended already.
        """
        self.fetch_tasks()
        record = self.state.record(task_id)
        if record is None:
            known = ", ".join(list(self.state.tasks)[-5:]) or "none"
            raise NotDoneError(f"no task {task_id}; the newest on the list: {known}")
        if record.state.is_terminal:
            raise NotDoneError(f"task {task_id} is {record.state.name} already")

        def state() -> TaskState:
            return self.state.state_of(task_id) or record.state

        self._repeat(lambda: self.link.cancel(task_id), lambda: state().is_terminal)
        if not state().is_terminal:
            raise self._no_answer(f"task {task_id} may not be cancelled")
        if state() is not TaskState.CANCELLED:
            became = f"task {task_id} became {state().name}"
            raise NotDoneError(f"{became} before it could be cancelled")

    def fetch_tasks(self, within: float = ANSWER_WITHIN) -> None:
        """Wait for the task list; raise NoHiveError if none comes within a time [s]."""
        self.link.listen(topics.SYNC)
        if self._pump(lambda: self.state.has_list, _AT_ONCE):
            return
        if not self.pump(lambda: self.state.has_list, within - _AT_ONCE):
            raise self._no_answer("its list is unknown")

    def fetch_leader(self) -> Standing:
        """Wait for the leader's heartbeat, for `SILENCE` at most; return whether there is one."""
        self.link.listen(topics.BACKUP)
        self._pump(lambda: self.state.heartbeat is not None, SILENCE)
        return self.state.leadership.standing(self.link.now())

    def fetch_robots(self) -> None:
        """Wait until every robot that the hive knows of has reported, or the leader for it.

        The leader names the robots that it hears and those that it no longer hears, so none is
        left out. Beside these, each node that tells of robots is waited for, for `STATUS_PERIOD`
        at most: it may have died, and the ROS master would not know.

        Raises:
            NoHiveError: Neither a robot nor a blackboard was heard.
        """
        self.link.listen(topics.ROBOT_STATUS, topics.BACKUP)
        self._pump(self.link.has_heard_robots, STATUS_PERIOD)
        if self.fetch_leader() is not Standing.NOBODY:
            self._pump(self._knows_the_hives_robots, ANSWER_WITHIN - STATUS_PERIOD)
        if not self.pump(lambda: bool(self.state.robots or self.state.heartbeat), ANSWER_WITHIN):
            raise self._no_answer("no robot was heard either")

    def hear_robots(self) -> bool:
        """Wait for the statuses of the robots that are there, for `STATUS_PERIOD` at most.

        Returns whether all of them have told theirs.
        """
        self.link.listen(topics.ROBOT_STATUS)
        return self._pump(self.link.has_heard_robots, STATUS_PERIOD)

    def _knows_the_hives_robots(self) -> bool:
        """Return whether every robot that the leader knows of has been heard of here too."""
        beat = self.state.heartbeat
        return beat is not None and {*beat.heard, *beat.offline} <= self.state.robots.keys()

    def fetch_robot(self, name: str) -> RobotRow:
        """Wait until the hive's robots are known, and return one of them.

        Raises:
            NoHiveError: Neither a robot nor a blackboard was heard.
            NotDoneError: There is no such robot, or it is not heard.
        """
        row = self.find_robot(name)
        if row.is_silent:
            raise NotDoneError(f"{name} is offline: {row.reason or 'not heard'}")
        return row

    def find_robot(self, name: str) -> RobotRow:
        """Do the same, also for a robot that is not heard any more."""
        self.fetch_robots()
        row = self.state.robots.get(name)
        if row is None:
            known = ", ".join(sorted(self.state.robots, key=natural)) or "none"
            raise NotDoneError(f"no robot {name}; there are: {known}")
        return row

    def command(self, robot: str, word: str) -> RobotRow:
        """Give a robot that was fetched a word on `set_state`, until it obeys; return its row.

        A robot that carries a load obeys `charge` once it has put it down; that is not waited for.

        Raises:
            NotDoneError: It cannot obey, or has not.
        """

        def row() -> RobotRow:
            return self.state.robots[robot]

        told = row()
        if word.startswith(PUT_DOWN) and not told.has_load_left:
            because = f" ({told.reason})" if told.reason else ""
            raise NotDoneError(
                f"{robot} has no load that was left on board{because}; a load that belongs to a "
                "task stays on board until the task is cancelled"
            )

        def obeyed() -> bool:
            return row() is not told and _is_so(row(), word)

        if not self.tell(robot, word, obeyed, is_so=_is_so(told, word)):
            now = row()
            because = f": {now.reason}" if now.reason else ""
            raise NotDoneError(
                f"{robot} is still {now.state.name.lower()}{because}; its log says why"
            )
        return row()

    def tell(
        self, robot: str, word: str, obeyed: Callable[[], bool], *, is_so: bool = False
    ) -> bool:
        """Give a robot a word on `set_state` until it obeys; return whether it has.

        Where everything `is_so` already, the robot gives no sign that it has heard.
        """
        if is_so:  # let the word arrive
            self.link.set_state(robot, word)
            self._pump(lambda: False, REPEAT_EVERY)
        self._repeat(lambda: self.link.set_state(robot, word), obeyed)
        return obeyed()

    def fetch_traffic(self) -> TrafficState:
        """Wait for the traffic planner's word, and return it.

        Raises:
            NoHiveError: None was heard.
        """
        self.link.listen(TRAFFIC_STATE)
        self._pump(lambda: self.state.traffic is not None, ANSWER_WITHIN)
        if self.state.traffic is None:
            raise NoHiveError(
                f"nothing is heard of a traffic planner within {ANSWER_WITHIN:g} s: the hive was "
                "started with traffic: local, or no member leads; `traffic: planned` in the fleet "
                "file starts one"
            )
        return self.state.traffic

    def switch_zone(self, name: str, *, closed: bool) -> None:
        """Close or open a zone, and wait until the traffic planner has.

        Raises:
            InputError: There is no such zone.
            NoHiveError: No traffic planner answered.
        """
        state = self.fetch_traffic()
        if name not in state.zones:
            allowed = ", ".join(state.zones) or "none; name some under `zones` in the fleet file"
            raise InputError(f"there is no zone '{name}'; allowed: {allowed}")

        def is_so() -> bool:
            return (name in self.fetch_traffic().closed) is closed

        self._repeat(lambda: self.link.switch(ZoneCommand(name, closed)), is_so)
        if not is_so():
            raise NoHiveError(
                f"no traffic planner answers within {ANSWER_WITHIN:g} s; zone {name} may not be "
                f"{'closed' if closed else 'open'}"
            )

    def change_map(self, path: Path, used: MapId) -> list[str]:
        """Have the map server read a file, and wait until the hive uses it.

        Args:
            path: The file's absolute path.
            used: The map that is in it.

        Returns:
            The robots that use it: all that are heard, but for those that do not say.

        Raises:
            NoHiveError: No map server answers that can do so.
            NotDoneError: It cannot use the file, or somebody does not use the map.
        """
        self.link.listen(topics.ROBOT_STATUS, topics.BACKUP)
        self.link.change_map(path)

        def others() -> dict[str, MapId]:
            beat = self.state.heartbeat
            told = {} if beat is None else {f"the leader, {member(beat.leader)},": beat.map}
            told |= {
                name: row.status.map
                for name, row in self.state.robots.items()
                if row.state is not RobotState.OFFLINE
            }
            return {name: each for name, each in told.items() if each.differs(used)}

        self._pump(lambda: not others(), NEW_MAP_WITHIN)
        if left := others():
            texts = [f"{name} uses {each}" for name, each in left.items()]
            raise NotDoneError(
                f"not everybody uses {used} after {NEW_MAP_WITHIN:g} s: {'; '.join(texts)}; "
                "robots that use another map than the leader get no tasks"
            )
        robots = self.state.robots.items()
        return [name for name, row in robots if row.status.map.checksum == used.checksum]

    def follow(self, ids: Iterable[str], timeout: float | None) -> dict[str, TaskState]:
        """Wait until tasks that the blackboard has answered have ended; return their final states.

        Raises:
            TimeUpError: Some have not ended within `timeout` [s]; None sets no limit.
        """
        ids = list(ids)

        def states() -> dict[str, TaskState]:
            return {i: self.state.state_of(i) or TaskState.WAITING for i in ids}

        if not self.pump(lambda: all(s.is_terminal for s in states().values()), timeout):
            left = [f"{i} is {s.name}" for i, s in states().items() if not s.is_terminal]
            raise TimeUpError(f"not ended after {timeout:g} s: {', '.join(left)}")
        return states()

    def _repeat(self, ask: Callable[[], None], answered: Callable[[], bool]) -> None:
        """Ask repeatedly until there is an answer or the time for answers is up."""
        end = self.link.now() + ANSWER_WITHIN
        ask()
        if self._pump(answered, REPEAT_EVERY):
            return
        while self.link.now() < end:
            ask()
            if self.pump(answered, REPEAT_EVERY):
                return

    def _no_answer(self, what: str) -> NoHiveError:
        heard = self.state.heartbeat
        who = f"the last one heard was {heard.leader.strip('/')}" if heard else "none was heard"
        why = next(iter(self.link.troubles()), "is the hive running?")
        return NoHiveError(
            f"no blackboard answers within {ANSWER_WITHIN:g} s ({who}); {what}; {why}"
        )


def _is_so(row: RobotRow, word: str) -> bool:
    """Return whether a robot does what a word on `set_state` says."""
    if word == "charge":
        is_later = row.status.payload > 0 and not row.has_load_left
        return row.state is RobotState.CHARGING or is_later
    if word.startswith(PUT_DOWN):
        return row.reason.startswith("brings") or not row.status.payload
    if word == "defect":
        return row.status.state is RobotState.DEFECT
    return row.status.state not in {RobotState.DEFECT, RobotState.CHARGING}


class Feeder:
    """Posts planned tasks, given in order, by the hive's clock; the first is due at 0 s from now.

    `before` is called with each task before it is posted.

    Raises:
        NoHiveError: The hive's clock is not heard.
    """

    def __init__(
        self,
        client: HiveClient,
        tasks: Iterable[PlannedTask],
        before: Callable[[Task], None] = lambda _task: None,
    ) -> None:
        self.states: dict[str, TaskState] = {}  # the hive's first word on each posted task, by id
        self._client = client
        self._waiting = deque(tasks)
        self._before = before
        self._start = client.link.hive_time(CLOCK_WITHIN)
        if self._start <= 0:
            raise NoHiveError(
                f"the hive's clock is not heard within {CLOCK_WITHIN:g} s; is its simulator "
                "running? Without one, set /use_sim_time to false and start the nodes again"
            )

    @property
    def done(self) -> bool:
        """Whether every task has been posted."""
        return not self._waiting

    def next_in(self, most: float) -> float:
        """Return the time until the next task is due, `most` at most [s]."""
        if not self._waiting:
            return most
        return min(max(self._waiting[0].after - self._elapsed(), 0.0), most)

    def post_due(self) -> dict[str, TaskUpdate | TaskRecord]:
        """Post the tasks that are due; return the hive's answer to each, by id.

        Raises:
            NoHiveError: No blackboard answered.
            NotDoneError: An id is on the task list already, for another task.
        """
        due = [planned.task for planned in self._waiting if planned.after <= self._elapsed()]
        for task in due:
            self._before(task)
        answers = {
            task.id: answer for task, answer in zip(due, self._client.submit_all(due), strict=True)
        }
        self.states |= {task_id: answer.state for task_id, answer in answers.items()}
        for _ in due:
            self._waiting.popleft()
        return answers

    def _elapsed(self) -> float:
        """Return the time since the scenario began [s]."""
        return self._client.link.hive_time() - self._start
