# SPDX-License-Identifier: BSD-3-Clause
"""Makes an allocation problem of what robots tell of themselves and of the tasks on the list.

Times and energies are those of `costing.effort`, from which robots bid, so a plan and a bid agree
on what a list takes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from blackboard.auction.search.problem import Problem, finite
from blackboard.costing.bidding import CHARGE_TOLERANCE
from blackboard.costing.effort import Effort, Job, Predictor, charge_to_reach
from blackboard.costing.experience import Experience, Learned, turnings
from blackboard.costing.insertion import Aging
from blackboard.domain.battery import Battery
from blackboard.domain.task import StepKind, TaskState, split_task, step_to_go_on

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from blackboard.auction.search.problem import Floats, Plan
    from blackboard.costing.bid_basis import BidBasis
    from blackboard.domain.path_lengths import PathLengths, Wanted
    from blackboard.domain.record import TaskRecord
    from blackboard.domain.task import Task
    from hive_common.pose import Pose

JOB_TIME = 1e-5
"""Processor time that the figures of one task for one kind of robots take [s]."""

BATCH = 25
"""Tasks that are surveyed at once: so many fields of path lengths are kept on any map."""


@dataclass(frozen=True, slots=True)
class Situation:
    """What is to be planned.

    Attributes:
        bases: What each robot tells, by its name.
        records: The tasks that wait, and those that robots have and have not begun, or have begun
            just now.
        get: Gives the record of any task.
        path_lengths_for: Gives the path lengths for a robot of a radius [m].
        now: The time on the clock of `Task.posted` [s].
    """

    bases: Mapping[str, BidBasis]
    records: Sequence[TaskRecord]
    get: Callable[[str], TaskRecord | None]
    path_lengths_for: Callable[[float], PathLengths]
    now: float


@dataclass(frozen=True, slots=True)
class Surveyed:
    """A problem and what its numbers stand for.

    Attributes:
        robots: Names of the robots.
        records: The tasks.
        plan: The robots' lists as they are.
        fixed: (robots,) how many tasks each does before, which stay where they are.
        ready: (robots,) what each does before anything that is planned.
        lengths: (robots,) arrays of (tasks + robots, tasks): the path from the end of each task,
            and from where each robot becomes free, to the beginning of each task [m].
        own_lengths: (robots,) arrays of (tasks,): the path from where a task begins to its end
            [m].
        left_out: Robots that tell that they take nothing, each with what it told.
        bases: What each of the other robots told.
    """

    problem: Problem
    robots: Sequence[str]
    records: Sequence[TaskRecord]
    plan: Plan
    fixed: Sequence[int]
    ready: Sequence[Effort]
    lengths: Sequence[Floats]
    own_lengths: Sequence[Floats]
    left_out: Mapping[str, BidBasis]
    bases: Mapping[str, BidBasis]


@dataclass(frozen=True, slots=True)
class _Robot:
    """A robot, and what it does before anything that is planned."""

    name: str
    basis: BidBasis
    predictor: Predictor
    lengths: PathLengths
    experience: Experience
    ready: Effort
    fixed: int
    row: tuple[int, ...]

    @property
    def alike(self) -> tuple[object, ...]:
        """What robots of one kind have in common."""
        return self.basis.body, self.experience.learned


def survey(situation: Situation) -> Iterator[float | Wanted | Surveyed]:
    """Yield the processor time of each piece of work [s], and at last what was surveyed.

    Path lengths that another process may compute are yielded before they are needed.

    Robots that tell that they take nothing are left out, and so are tasks of which nothing is left
    to be done.
    """
    jobs = {record.task.id: record for record in situation.records if _begins(record)}
    records = list(jobs.values())
    number = {task_id: index for index, task_id in enumerate(jobs)}
    yield from _wanted_for_lists(situation, number)
    robots = [
        _robot(name, basis, situation, number, records)
        for name, basis in sorted(situation.bases.items())
        if not basis.refusal
    ]
    robots = [robot for robot in robots if math.isfinite(robot.ready.duration)]
    yield JOB_TIME * len(robots)
    if not robots or not records:
        return
    robots = _sharing(robots)
    ways = [_way(record.task, step_to_go_on(record.task, record.step)) for record in records]
    starts = [*(way[-1] for way in ways), *(robot.ready.end for robot in robots)]
    tables: dict[int, tuple[Floats, Floats]] = {}
    kinds = {robot.alike: robot for robot in robots}
    split: dict[tuple[object, ...], list[Job]] = {alike: [] for alike in kinds}
    for path_lengths in {id(robot.lengths): robot.lengths for robot in robots}.values():
        columns = []
        for first in range(0, len(records), BATCH):
            batch = slice(first, first + BATCH)
            yield from _wanted(path_lengths, ways[batch])
            for *column, taken in path_lengths.columns(starts, [way[0] for way in ways[batch]]):
                columns.append(column)
                yield taken
            for alike, robot in kinds.items():
                if robot.lengths is path_lengths:
                    split[alike] += [_job(record, robot.predictor) for record in records[batch]]
                    yield JOB_TIME * BATCH
        lengths, delays = np.array(columns).transpose(1, 2, 0)
        tables[id(path_lengths)] = lengths, delays
    turning = turnings(starts, [way[0] for way in ways])
    made = []
    for alike, robot in kinds.items():
        lengths, delays = tables[id(robot.lengths)]
        made.append(_figures(robot.predictor, split[alike], lengths, delays, turning))
        yield JOB_TIME * len(records)
    yield _surveyed(situation, robots, records, list(kinds), made, tables)


def _wanted_for_lists(situation: Situation, planned: Collection[str]) -> Iterator[Wanted]:
    """Yield what is to be computed for what robots do before anything that is planned.

    These are the drives of other tasks on their lists, and to chargers after them.
    """
    bases = [basis for basis in situation.bases.values() if not basis.refusal]
    for radius in sorted({basis.body.radius for basis in bases}):
        ways: list[Sequence[Pose]] = []
        for basis in bases:
            if basis.body.radius == radius:
                fixed = [listed for listed in basis.tasks if listed[0] not in planned]
                records = [(situation.get(task_id), step) for task_id, step in fixed]
                ways += [_way(record.task, step) for record, step in records if record]
                ways += [(place,) for place in basis.chargers]
        yield from _wanted(situation.path_lengths_for(radius), ways)


def _wanted(path_lengths: PathLengths, ways: Sequence[Sequence[Pose]]) -> Iterator[Wanted]:
    """Yield what is to be computed of paths, until all is there or nothing comes."""
    last = None
    while (wanted := path_lengths.wanted(ways)) is not None and wanted.job.goals != last:
        last = wanted.job.goals
        yield wanted


def _way(task: Task, step: int) -> list[Pose]:
    """Return where the drives of a task go from a step on."""
    return [each.goal for each in split_task(task)[step:] if each.kind is StepKind.MOVE]


def _begins(record: TaskRecord) -> bool:
    """Return whether a task begins with a drive, so that any robot can begin it."""
    left = split_task(record.task)[step_to_go_on(record.task, record.step) :]
    return bool(left) and left[0].kind is StepKind.MOVE


def _job(record: TaskRecord, predictor: Predictor) -> Job:
    return Job(record.task, step_to_go_on(record.task, record.step), predictor)


def _robot(
    name: str,
    basis: BidBasis,
    situation: Situation,
    number: Mapping[str, int],
    records: Sequence[TaskRecord],
) -> _Robot:
    lengths = situation.path_lengths_for(basis.body.radius)
    experience = Experience(basis.body, basis.pace)
    predictor = Predictor(basis.body, lengths, experience)
    ready, fixed, row = Effort(0.0, 0.0, 0.0, basis.pose), 0, []
    for place, (task_id, step) in enumerate(basis.tasks):
        index = number.get(task_id)
        begun = basis.at_work and place == 0
        if index is not None and (not begun or records[index].state is TaskState.STARTED):
            record = records[index]
            if record.robot == name and step == step_to_go_on(record.task, record.step):
                row.append(index)
                continue
        listed = situation.get(task_id)
        if listed is not None:
            ready = ready.then(predictor.effort(listed.task, step, ready.end))
            fixed += 1
    return _Robot(name, basis, predictor, lengths, experience, ready, fixed, tuple(row))


def _sharing(robots: list[_Robot]) -> list[_Robot]:
    """Return robots of one body with their mean experience.

    The first one to learn that drives take less than it had assumed would look faster, and tasks
    would go to it, and back when the others have learned it too.
    """
    shared = []
    for robot in robots:
        body = robot.basis.body
        same = [each.experience.learned for each in robots if each.basis.body == body]
        experience = Experience(body, Learned(*np.mean(same, axis=0).tolist()))
        predictor = Predictor(body, robot.lengths, experience)
        shared.append(replace(robot, predictor=predictor, experience=experience))
    return shared


@dataclass(frozen=True, slots=True)
class _Figures:
    """What drives and tasks take the robots of one kind; see `Problem`."""

    leg: Floats
    leg_draw: Floats
    own: Floats
    own_draw: Floats
    own_length: Floats


def _figures(
    predictor: Predictor,
    jobs: Sequence[Job],
    lengths: Floats,
    delays: Floats,
    turning: Floats,
) -> _Figures:
    rests = [job.rest for job in jobs if job.rest is not None]
    forces = np.array([job.force for job in jobs])
    draws, times = predictor.legs(lengths, delays, turning, forces)
    own = np.array([rest.duration for rest in rests])
    own_draw = np.array([rest.energy for rest in rests])
    own_length = np.array([rest.distance for rest in rests])
    return _Figures(
        _spaced(times), _spaced(draws), np.append(own, 0.0), np.append(own_draw, 0.0), own_length
    )


def _spaced(table: Floats) -> Floats:
    """Return a table with a row and a column of 0 for `nothing` behind the tasks."""
    tasks = table.shape[1]
    return np.insert(np.insert(finite(table), tasks, 0.0, axis=0), tasks, 0.0, axis=1)


def _surveyed(
    situation: Situation,
    robots: Sequence[_Robot],
    records: Sequence[TaskRecord],
    kinds: Sequence[tuple[object, ...]],
    made: Sequence[_Figures],
    tables: Mapping[int, tuple[Floats, Floats]],
) -> Surveyed:
    kind = np.array([kinds.index(robot.alike) for robot in robots])
    own = np.array([each.own for each in made])
    able = np.array([_able(robot, records) for robot in robots])
    for index, robot in enumerate(robots):
        lengths, _ = tables[id(robot.lengths)]
        able[index] &= np.isfinite(lengths[len(records) + index])
        able[index] &= np.isfinite(own[kind[index], :-1])
    able = _without_vain_tries(able, robots, records)
    priority = np.array([record.task.priority for record in records])
    problem = Problem(
        kind,
        np.array([each.leg for each in made]),
        np.array([each.leg_draw for each in made]),
        finite(own),
        finite(np.array([each.own_draw for each in made])),
        np.array([robot.ready.duration for robot in robots]),
        np.full(len(robots), np.inf),
        np.array([_weight(robots, record.task, situation.now) for record in records]),
        priority,
        able,
    )
    most = _limits(problem, robots)
    problem = replace(problem, most=most)
    names = [robot.name for robot in robots]
    plan = tuple(robot.row for robot in robots)
    return Surveyed(
        problem,
        names,
        records,
        plan,
        [robot.fixed for robot in robots],
        [robot.ready for robot in robots],
        [tables[id(robot.lengths)][0] for robot in robots],
        [made[index].own_length for index in kind],
        {name: each for name, each in situation.bases.items() if name not in names},
        {robot.name: robot.basis for robot in robots},
    )


def _able(robot: _Robot, records: Sequence[TaskRecord]) -> list[bool]:
    excludes = robot.basis.body.excludes
    return [not excludes(record.task) for record in records]


def _without_vain_tries(
    able: NDArray[np.bool_], robots: Sequence[_Robot], records: Sequence[TaskRecord]
) -> NDArray[np.bool_]:
    """Leave tasks to robots that have not tried them in vain, as long as there are some."""
    for index, record in enumerate(records):
        fresh = able[:, index] & [robot.name not in record.tried for robot in robots]
        if record.tried and fresh.any():
            able[:, index] = fresh
    return able


def _weight(robots: Sequence[_Robot], task: Task, now: float) -> float:
    """Return what a second of waiting counts; the robots of a fleet agree on it."""
    return Aging(lambda: now, robots[0].basis.aging).weight(task)


def _limits(problem: Problem, robots: Sequence[_Robot]) -> Floats:
    """Return until when each robot may be at work with the charge it has [s].

    As in a bid it keeps a share of it, and what the drive to a charger takes. It is infinite where
    no list can become that long.
    """
    longest = problem.ready + (problem.leg.max(axis=(0, 1)) + problem.own.max(axis=0)).sum()
    most = np.array([_endurance(robot) for robot in robots])
    return np.where(most >= longest, np.inf, np.maximum(most, 0.0))


def _endurance(robot: _Robot) -> float:
    body, basis = robot.basis.body, robot.basis
    battery = Battery(body.battery, basis.charge)
    learned = robot.experience.learned
    reserve = charge_to_reach(
        basis.chargers, robot.ready.end, body, robot.lengths, battery, robot.experience
    )
    charge = battery.charge_left - reserve - CHARGE_TOLERANCE * battery.capacity
    speed = 1.0 / max(learned.per_metre, 1.0 / body.max_speed)
    driving = robot.predictor.force(body.payload) * speed
    power = max(driving, learned.power * body.arm_power) + learned.power * body.idle_power
    most = battery.charge_for(robot.experience.most_energy(power))
    return charge / most if most > 0.0 else math.inf
