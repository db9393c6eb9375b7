# SPDX-License-Identifier: BSD-3-Clause
"""A robot's arm, which goes on when the robot's process ends, and where every load is.

The arm's action server is a process of its own. It finishes what it has begun, remembers its
actions by their ids, and knows what it holds; see blackboard/Pick.action.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import TYPE_CHECKING, NoReturn

from blackboard.domain.task import StepKind
from blackboard.robot.executor import CommandResult, CommandState

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.domain.task import TaskStep
    from hive_lab.fault_schedules.faulty_network import Host

_SUCCESS = CommandResult(CommandState.SUCCEEDED)
_DROPPED = CommandResult(CommandState.ABORTED, "the grip failed; the load is where it was")
_NOTHING = CommandResult(CommandState.ABORTED, "the load of this task is not on board")


class LoadChecker:
    """Follows each load: a load is picked once and put down once, and a robot holds one.

    A task that is posted under the id of a forgotten one has a load of its own, and an arm may
    still move that of the forgotten one. The assignment in an action's id tells them apart.

    Args:
        broken: Ends the run; takes the broken property and the observation.

    Attributes:
        arms: Of the robots that are followed, by name.
        unclear: Tasks whose loads nobody can follow: the hive has lost what robots did with them.
    """

    def __init__(self, broken: Callable[[str, str], NoReturn]) -> None:
        self._broken = broken
        self._begun_anew: dict[str, list[tuple[str, int]]] = defaultdict(list)
        self._picked: dict[tuple[str, int], str] = {}
        self._put_down: Counter[tuple[str, int]] = Counter()
        self.arms: dict[str, SimulatedArm] = {}
        self.unclear: set[str] = set()

    def follow(self, robot: str, arm: SimulatedArm) -> None:
        """Follow the loads of one more robot."""
        self.arms[robot] = arm
        arm.loads = self

    def pick(self, robot: str, step: TaskStep, on_board: str) -> None:
        """Record that a robot has picked the load of a step; `on_board` is what it held."""
        task, load = step.task_id, self._load_of(step)
        if on_board:
            what = f"{robot} picks the load of {task} and has that of {on_board} on board"
            self._broken("one load, one place", what)
        if load in self._picked and task not in self.unclear:
            first = self._picked[load]
            what = f"{robot} picks a load of {task}, which {first} has picked"
            self._broken("one load, one place", what)
        self._picked[load] = robot

    def put_down(self, robot: str, step: TaskStep) -> None:
        """Record that a robot has put the load of a step down."""
        task, load = step.task_id, self._load_of(step)
        self._put_down[load] += 1
        is_wrong = self._put_down[load] > 1 or self._picked.get(load) != robot
        if is_wrong and task not in self.unclear:
            what = f"{robot} puts a load of {task} down that is not on board"
            self._broken("one load, one place", what)

    def check_done(self, task: str, hive: str, assignment: int) -> None:
        """Check that the load of a task that counts as carried to its goal was put down.

        `assignment` is the number of the task's last assignment in a hive.
        """
        times = self._put_down[self._load(task, hive, assignment)]
        if times != 1 and task not in self.unclear:
            what = f"{task} is done, and its load was put down {times} times"
            self._broken("one load, one place", what)

    def begin_anew(self, task: str, hive: str, assignment: int) -> None:
        """Expect another load under the id of a task that a hive has forgotten.

        `assignment` is the number of the last assignment in that hive that is not for it.
        """
        self._begun_anew[task].append((hive, assignment))
        self.unclear.discard(task)

    def is_of_an_earlier_task(self, step: TaskStep) -> bool:
        """Return whether an arm's step belongs to a forgotten task whose id another one has."""
        return self._load_of(step)[1] < len(self._begun_anew[step.task_id])

    def _load_of(self, step: TaskStep) -> tuple[str, int]:
        """Return which load a step is about."""
        if not step.action:
            return step.task_id, len(self._begun_anew[step.task_id])
        hive, _, rest = step.action.partition("/")
        return self._load(step.task_id, hive, int(rest.rsplit("/", 2)[1]))

    def _load(self, task: str, hive: str, assignment: int) -> tuple[str, int]:
        """Return which load an assignment in a hive is about: a task, and which of that id."""
        begun = self._begun_anew[task]
        later = (
            number
            for number, (where, last) in enumerate(begun)
            if where == hive and assignment <= last
        )
        return task, next(later, len(begun))


class SimulatedArm:
    """One robot's arm with its action server, which outlives the robot's process.

    Attributes:
        loads: Follows the loads; without one, nobody does.
        load: The step with which the arm took what is on board; None if nothing is.
    """

    def __init__(self, host: Host) -> None:
        self._host = host
        self._run = 0
        self._action = ""
        self._done: dict[str, CommandResult] = {}
        self._tell: tuple[int, Callable[[CommandResult], None]] | None = None
        self.loads: LoadChecker | None = None
        self.load: TaskStep | None = None

    def knows(self, step: TaskStep) -> CommandResult | None:
        """Return how an action has ended that was begun before; None if it is to be done."""
        if step.action in self._done:
            return self._done[step.action]
        if step.kind is not StepKind.PICK or not step.look or self.load is None:
            return None
        if step.handles_the_load_of(self.load):
            return _SUCCESS
        what = f"the load of task {self.load.task_id} is on board"
        return CommandResult(CommandState.OCCUPIED, what)

    def is_at(self, step: TaskStep) -> bool:
        """Return whether an action is under way."""
        return bool(step.action) and self._action == step.action

    def join(self, done: Callable[[CommandResult], None]) -> None:
        """Tell the robot's present process how the action under way ends."""
        self._tell = self._host.generation, done

    def start(
        self,
        step: TaskStep,
        duration: float,
        done: Callable[[CommandResult], None],
        *,
        works: bool,
    ) -> None:
        """Begin an action in place of the one before; it takes `duration` [s]."""
        self._run += 1
        self._action = step.action
        self.join(done)
        self._host.network.schedule(duration, None, self._end, (self._run, step, works))

    def cancel(self) -> None:
        """Stop; the load stays where it is."""
        self._run += 1
        self._action, self._tell = "", None

    def take_off(self) -> None:
        """Let a person take what is on board."""
        self.load = None

    def _end(self, what: tuple[int, TaskStep, bool]) -> None:
        run, step, works = what
        if run != self._run:
            return
        result = self._move(step) if works else _DROPPED
        if step.action and result is _SUCCESS:
            self._done[step.action] = result
        tell, self._action, self._tell = self._tell, "", None
        if tell is not None and tell[0] == self._host.generation:
            self._host.network.schedule(0.0, self._host, tell[1], result)

    def _move(self, step: TaskStep) -> CommandResult:
        """Move the load."""
        if step.kind is StepKind.PICK:
            if self.loads is not None:
                on_board = "" if self.load is None else self.load.task_id
                self.loads.pick(self._host.name, step, on_board)
            self.load = step
            return _SUCCESS
        if self.load is None or not step.handles_the_load_of(self.load):
            return _NOTHING
        if self.loads is not None:
            self.loads.put_down(self._host.name, step)
        self.load = None
        return _SUCCESS
