# SPDX-License-Identifier: BSD-3-Clause
"""The search for a plan: ruin and recreate, over arrays, in compiled code.

What is on no list is auctioned first, one task after the other: it is a sequential single-item
auction (Lagoudakis et al., "Auction-based multi-robot routing", 2005). Then each round takes some
tasks that lie near each other off their lists, and puts each back at its best place, which chance
passes over now and then. A round that makes the plan worse is kept with a probability that falls
(simulated annealing).

Sources: G. Schrimpf et al., "Record Breaking Optimization Results Using the Ruin and Recreate
Principle", Journal of Computational Physics 159, 2000; J. Christiaens and G. Vanden Berghe, "Slack
Induction by String Removals for Vehicle Routing Problems", Transportation Science 54, 2020.

All of the search is in this file: numba's cache does not notice that a function of another file
has changed.
"""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from blackboard.auction.search.offers import OFFER_TIME, offers_for
from blackboard.auction.search.searcher import Found
from blackboard.costing.cost import LATEST_COUNT
from hive_common.compiled import compiled

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from blackboard.auction.search.problem import Floats, Numbers, Problem
    from blackboard.auction.search.searcher import Job

WAY, MAKESPAN, WAITING = 0, 1, 2
OBJECTIVES: Mapping[str, int] = MappingProxyType(
    {"way": WAY, "makespan": MAKESPAN, "waiting": WAITING}
)
"""What to make small, by `domain.settings.MEASURE_NAMES`; what a way takes is energy."""

_POWER = LATEST_COUNT
_SCALE = 100.0  # [s]

_MOST_OUT = 20  # so many tasks are taken off lists in a round at most
_LONGEST = 10  # so many of them from one list
_BLINK = 0.01  # probability with which a better place is passed over
_HOT, _COLD = 0.3, 0.005
"""By what share of the mean cost of a task the plan may get worse, in the first and last round."""

_NEIGHBOURS = 40  # so many tasks near each are known
_ASK_ALL = 24
"""A fleet of more robots is not asked as a whole where to put a task, but those whose lists were
changed in the round, those that have the tasks nearest to it, and some at random."""
_ASK_NEAR, _ASK_MORE = 20, 4

ROUND_TIME, PLACE_TIME = 1.8e-6, 6e-9
"""Processor time of a round, and of each place that it looks at [s], measured with up to 20 robots
and 100 tasks; tables of 1,000 tasks do not fit into the processor's caches and take up to twice as
long."""

_BY_CHANCE, _LONG_FIRST = 0.5, 0.75  # shares of the rounds, for the order in which tasks are put
_URGENT = 1e12  # more than any time [s]


class _Facts(NamedTuple):
    """What does not change; see `Problem`."""

    goal: int
    kind: Numbers
    leg: Floats
    own: Floats
    leg_draw: Floats
    own_draw: Floats
    ready: Floats
    most: Floats
    weight: Floats
    priority: Numbers
    able: NDArray[np.bool_]
    holder: Numbers  # (tasks,) who has a task, -1 for nobody
    move: float  # what it costs to give it to another robot
    near: Numbers  # (tasks, n) the tasks nearest to each


class _Lists(NamedTuple):
    """A plan, and what it costs."""

    order: Numbers  # (robots, tasks + 1) tasks
    length: Numbers  # (robots,)
    owner: Numbers  # (tasks,) whose list a task is on, -1 for none
    done: Floats  # (robots, tasks + 2) when the robot is free before each place [s]
    behind: Floats  # (robots, tasks + 2) weight of all tasks from each place on
    moved: Floats  # (robots,) what moves cost
    cost: Floats  # (robots,)
    changed: NDArray[np.bool_]  # (robots,) in this round
    asked: NDArray[np.bool_]  # (robots,) for places


def search(job: Job) -> Found:
    """Improve a plan, and put what is on no list on one.

    The same job gives the same plan on every machine.
    """
    problem, goal, move = job.problem, OBJECTIVES[job.measure], job.move
    tasks, robots = problem.nothing, problem.robots
    order = np.full((robots, tasks + 1), tasks, dtype=np.int64)
    for row, listed in zip(order, job.plan, strict=True):
        row[: len(listed)] = listed
    length = np.array([len(listed) for listed in job.plan], dtype=np.int64)
    if goal == WAY:
        move *= _power_of(problem)
    lists, lengths, before, auctioned, after, spent = _search(
        goal,
        problem.kind.astype(np.int64),
        np.ascontiguousarray(problem.leg),
        np.ascontiguousarray(problem.own),
        np.ascontiguousarray(problem.leg_draw),
        np.ascontiguousarray(problem.own_draw),
        problem.ready,
        problem.most,
        problem.weight,
        problem.priority.astype(np.int64),
        np.ascontiguousarray(problem.able),
        float(move),
        _neighbours(problem),
        order,
        length,
        job.seed,
        job.rounds,
        job.seconds,
        job.share,
    )
    rows = zip(lists.tolist(), lengths.tolist(), strict=True)
    plan = tuple(tuple(row[:count]) for row, count in rows)
    offers = offers_for(problem, plan, job.measure)
    spent += OFFER_TIME * robots * tasks
    return Found(plan, before, auctioned, after, spent, offers)


def _power_of(problem: Problem) -> float:
    """Return what robots draw while they drive, about [W]."""
    time = float(problem.leg.sum())
    return float(problem.leg_draw.sum()) / time if time > 0.0 else 0.0


def _neighbours(problem: Problem) -> Numbers:
    """Return the tasks nearest to each, by the shorter drive between them."""
    tasks = problem.nothing
    legs = problem.leg[0, :tasks, :tasks]
    apart = np.minimum(legs, legs.T)
    np.fill_diagonal(apart, np.inf)
    count = min(tasks - 1, _NEIGHBOURS)
    if count < 1:
        return np.zeros((tasks, 0), dtype=np.int64)
    rows = np.arange(tasks)[:, None]
    near = np.argpartition(apart, count - 1, axis=1)[:, :count]
    by_length = np.argsort(apart[rows, near], axis=1, kind="stable")
    return np.ascontiguousarray(near[rows, by_length], dtype=np.int64)


@compiled()
def _load(finish: float) -> float:
    """Return a number that makes the latest robots outweigh the others.

    Only the latest of all robots counts, but a sum over lists is compared. A high power
    approximates that, and still rewards the other robots for being early.
    """
    return float((finish / _SCALE) ** _POWER)


@compiled()
def _renew(facts: _Facts, lists: _Lists, robot: int) -> None:
    """Work out what a list costs, after it was changed."""
    kind, count = facts.kind[robot], lists.length[robot]
    at, energy, waiting, moved = facts.ready[robot], 0.0, 0.0, 0.0
    node = len(facts.weight) + 1 + robot
    lists.done[robot, 0] = at
    for place in range(count):
        task = lists.order[robot, place]
        at += facts.leg[kind, node, task] + facts.own[kind, task]
        energy += facts.leg_draw[kind, node, task] + facts.own_draw[kind, task]
        waiting += facts.weight[task] * at
        lists.done[robot, place + 1] = at
        if facts.holder[task] >= 0 and facts.holder[task] != robot:
            moved += facts.move
        node = task
    behind = 0.0
    lists.behind[robot, count] = 0.0
    for back in range(count):
        place = count - 1 - back
        behind += facts.weight[lists.order[robot, place]]
        lists.behind[robot, place] = behind
    lists.moved[robot] = moved
    if facts.goal == MAKESPAN:
        lists.cost[robot] = _load(at + moved)
    elif facts.goal == WAY:
        lists.cost[robot] = energy + moved
    else:
        lists.cost[robot] = waiting + moved


@compiled()
def _places(order: Numbers, count: int, priority: Numbers, urgency: int) -> tuple[int, int]:
    """Return the first and the last place in a list for a task, behind what is more urgent."""
    first = 0
    while first < count and priority[order[first]] > urgency:
        first += 1
    last = first
    while last < count and priority[order[last]] == urgency:
        last += 1
    return first, last


@compiled()
def _best_place(
    facts: _Facts, lists: _Lists, task: int, blink: float, begin: int, end: int
) -> tuple[int, int, float, int]:
    """Return the robot, the place and the cost where a task adds least; -1 for none.

    Those robots from `begin` to before `end` count that are asked. The last number is how many
    places were looked at.
    """
    # A look at an array of a tuple takes longer than what is done with it.
    leg, leg_draw, nothing, goal = facts.leg, facts.leg_draw, len(facts.weight), facts.goal
    order, done, behind, lengths = lists.order, lists.done, lists.behind, lists.length
    able, asked, weight, holder = facts.able, lists.asked, facts.weight[task], facts.holder[task]
    best, taker, where, looked = np.inf, -1, -1, 0
    for robot in range(begin, end):
        if not asked[robot] or not able[robot, task]:
            continue
        kind, count = facts.kind[robot], lengths[robot]
        own, own_draw = facts.own[kind, task], facts.own_draw[kind, task]
        move = facts.move if holder >= 0 and holder != robot else 0.0
        first, last = _places(order[robot], count, facts.priority, facts.priority[task])
        node = order[robot, first - 1] if first > 0 else nothing + 1 + robot
        late, latest = lists.moved[robot] + move, facts.most[robot]
        finish, load = done[robot, count], lists.cost[robot]
        looked += count + 1
        for place in range(first, last + 1):
            after = order[robot, place] if place < count else nothing
            go = leg[kind, node, task] + own
            added = go + leg[kind, task, after] - leg[kind, node, after]
            if goal == WAITING:
                cost = weight * (done[robot, place] + go) + added * behind[robot, place] + move
            elif goal == MAKESPAN:
                cost = _load(finish + added + late) - load
            else:
                ways = leg_draw[kind, node, task] + leg_draw[kind, task, after]
                cost = ways + own_draw - leg_draw[kind, node, after] + move
            node = after
            if cost < best and finish + added <= latest:
                if blink > 0.0 and np.random.random() < blink:  # noqa: NPY002
                    continue
                best, taker, where = cost, robot, place
    return taker, where, best, looked


@compiled()
def _put(facts: _Facts, lists: _Lists, robot: int, place: int, task: int) -> None:
    """Put a task into a list."""
    order = lists.order[robot]
    for back in range(lists.length[robot], place, -1):
        order[back] = order[back - 1]
    order[place] = task
    lists.length[robot] += 1
    lists.owner[task] = robot
    lists.changed[robot] = True
    _renew(facts, lists, robot)


@compiled()
def _take_out(lists: _Lists, robot: int, first: int, size: int, out: Numbers, count: int) -> int:
    """Take consecutive tasks off a list, add them to those that are out, and return how many."""
    order = lists.order[robot]
    for place in range(first, first + size):
        lists.owner[order[place]] = -1
        out[count] = order[place]
        count += 1
    lists.length[robot] -= size
    for place in range(first, lists.length[robot]):
        order[place] = order[place + size]
    return count


@compiled()
def _ruin(facts: _Facts, lists: _Lists, out: Numbers) -> int:
    """Take tasks near a random one off their lists; return how many are on none."""
    tasks = len(facts.weight)
    count = 0
    for task in range(tasks):
        if lists.owner[task] < 0:
            out[count] = task
            count += 1
    most = count + 1 + int(np.random.random() * min(_MOST_OUT, tasks))  # noqa: NPY002
    longest = 1 + int(np.random.random() * _LONGEST)  # noqa: NPY002
    first = int(np.random.random() * tasks)  # noqa: NPY002
    for index in range(-1, facts.near.shape[1]):
        task = first if index < 0 else facts.near[first, index]
        robot = lists.owner[task]
        if robot < 0 or lists.changed[robot]:
            continue
        if count >= most:
            break
        size = 1 + int(np.random.random() * longest)  # noqa: NPY002
        size = min(size, lists.length[robot], most - count)
        place = 0
        while lists.order[robot, place] != task:
            place += 1
        low, high = max(0, place - size + 1), min(place, lists.length[robot] - size)
        begin = low + int(np.random.random() * (high - low + 1))  # noqa: NPY002
        count = _take_out(lists, robot, begin, size, out, count)
        lists.changed[robot] = True
        _renew(facts, lists, robot)
    return count


@compiled()
def _sort(facts: _Facts, out: Numbers, count: int, keys: Floats) -> None:
    """Bring tasks that are out into the order in which they are put: urgent ones first."""
    how = np.random.random()  # noqa: NPY002
    for index in range(count):
        task = out[index]
        if how < _BY_CHANCE:
            key = np.random.random()  # noqa: NPY002
        elif how < _LONG_FIRST:
            key = -facts.own[0, task]
        else:
            key = facts.own[0, task]
        keys[index] = key - _URGENT * facts.priority[task]
    for index in range(1, count):
        task, key, place = out[index], keys[index], index
        while place > 0 and keys[place - 1] > key:
            keys[place], out[place] = keys[place - 1], out[place - 1]
            place -= 1
        keys[place], out[place] = key, task


@compiled()
def _ask(facts: _Facts, lists: _Lists, task: int) -> None:
    """Choose the robots of a large fleet whose lists may get a task."""
    robots = len(lists.length)
    lists.asked[:] = lists.changed
    for index in range(min(_ASK_NEAR, facts.near.shape[1])):
        robot = lists.owner[facts.near[task, index]]
        if robot >= 0:
            lists.asked[robot] = True
    for _ in range(_ASK_MORE):
        lists.asked[int(np.random.random() * robots)] = True  # noqa: NPY002


@compiled()
def _recreate(facts: _Facts, lists: _Lists, out: Numbers, count: int) -> tuple[int, int]:
    """Put tasks into lists; return how many are left out, and how many places were looked at."""
    left, looked, robots = 0, 0, len(lists.length)
    large = robots > _ASK_ALL
    for index in range(count):
        task = out[index]
        robot = -1
        if large:
            _ask(facts, lists, task)
            robot, place, _, more = _best_place(facts, lists, task, _BLINK, 0, robots)
            looked += more
            lists.asked[:] = True
        if robot < 0:
            robot, place, _, more = _best_place(facts, lists, task, _BLINK, 0, robots)
            looked += more
        if robot < 0:
            left += 1
        else:
            _put(facts, lists, robot, place, task)
    return left, looked


@compiled()
def _bid(facts: _Facts, lists: _Lists, robot: int, bids: Floats) -> int:
    """Have a robot bid on all open tasks; return how many places were looked at."""
    looked = 0
    for task in range(len(bids)):
        bids[task] = np.inf
        if lists.owner[task] < 0:
            _, _, bids[task], more = _best_place(facts, lists, task, 0.0, robot, robot + 1)
            looked += more
    return looked


@compiled()
def _first(facts: _Facts, lists: _Lists, bids: Floats) -> int:
    """Return the open task of a robot's best bid, the most urgent ones first; -1 for none."""
    best = -1
    for task in range(len(bids)):
        if lists.owner[task] < 0 and bids[task] < np.inf:
            urgent = facts.priority[task]
            if (
                best < 0
                or urgent > facts.priority[best]
                or (urgent == facts.priority[best] and bids[task] < bids[best])
            ):
                best = task
    return best


@compiled()
def _auction(facts: _Facts, lists: _Lists) -> tuple[int, int]:
    """Give out what is on no list, the best bid of all first; return the same as `_recreate`."""
    robots, tasks = len(lists.length), len(facts.weight)
    bids, looked = np.full((robots, tasks), np.inf), 0
    first = np.empty(robots, dtype=np.int64)  # the task of each robot's best bid
    for robot in range(robots):
        looked += _bid(facts, lists, robot, bids[robot])
        first[robot] = _first(facts, lists, bids[robot])
    while True:
        taker = -1
        for robot in range(robots):
            task = first[robot]
            if task >= 0 and lists.owner[task] >= 0:
                task = first[robot] = _first(facts, lists, bids[robot])
            if task >= 0 and (
                taker < 0
                or facts.priority[task] > facts.priority[first[taker]]
                or (
                    facts.priority[task] == facts.priority[first[taker]]
                    and bids[robot, task] < bids[taker, first[taker]]
                )
            ):
                taker = robot
        if taker < 0:
            return int((lists.owner < 0).sum()), looked
        task = first[taker]
        _, place, _, _ = _best_place(facts, lists, task, 0.0, taker, taker + 1)
        _put(facts, lists, taker, place, task)
        looked += _bid(facts, lists, taker, bids[taker])
        first[taker] = _first(facts, lists, bids[taker])


@compiled()
def _keep(lists: _Lists, order: Numbers, length: Numbers) -> None:
    """Copy the lists that were changed."""
    for robot in range(len(length)):
        if lists.changed[robot]:
            length[robot] = lists.length[robot]
            for place in range(length[robot]):
                order[robot, place] = lists.order[robot, place]


@compiled()
def _restore(facts: _Facts, lists: _Lists, order: Numbers, length: Numbers) -> None:
    """Undo a round."""
    for robot in range(len(length)):
        if lists.changed[robot]:
            for place in range(lists.length[robot]):
                lists.owner[lists.order[robot, place]] = -1
    for robot in range(len(length)):
        if lists.changed[robot]:
            lists.length[robot] = length[robot]
            for place in range(length[robot]):
                lists.order[robot, place] = order[robot, place]
                lists.owner[order[robot, place]] = robot
            _renew(facts, lists, robot)


@compiled()
def _improve(
    facts: _Facts, lists: _Lists, left: int, rounds: int, seconds: float
) -> tuple[Numbers, Numbers, float]:
    """Do the rounds; return the best lists, their lengths, and the processor time spent [s]."""
    tasks = len(facts.weight)
    out, keys = np.empty(tasks, dtype=np.int64), np.empty(tasks)
    order, length = lists.order.copy(), lists.length.copy()
    best_order, best_length = order.copy(), length.copy()
    kept = best = lists.cost.sum()
    kept_left = best_left = left
    heat, spent = _HOT * kept / max(1, tasks), 0.0
    cooling = (_COLD / _HOT) ** (1.0 / max(1, rounds))
    for _ in range(rounds):
        if spent >= seconds:
            break
        lists.changed[:] = False
        count = _ruin(facts, lists, out)
        _sort(facts, out, count, keys)
        left, looked = _recreate(facts, lists, out, count)
        spent += ROUND_TIME + PLACE_TIME * looked
        cost = lists.cost.sum()
        chance = -heat * math.log(1.0 - np.random.random())  # noqa: NPY002
        heat *= cooling
        if left > kept_left or (left == kept_left and cost >= kept + chance):
            _restore(facts, lists, order, length)
            continue
        _keep(lists, order, length)
        kept, kept_left = cost, left
        if left < best_left or (left == best_left and cost < best):
            best, best_left = cost, left
            best_order[:], best_length[:] = order, length
    return best_order, best_length, spent


@compiled()
def _mean_time(lists: _Lists) -> float:
    """Return the mean time until a task is done [s]; 0 without tasks."""
    total, tasks = 0.0, 0
    for robot in range(len(lists.length)):
        for place in range(lists.length[robot]):
            total += lists.done[robot, place + 1]
            tasks += 1
    return total / max(1, tasks)


_FLOATS_3, _FLOATS_2 = "float64[:, :, ::1]", "float64[:, ::1]"


@compiled(
    "Tuple((int64[:, ::1], int64[::1], float64, float64, float64, float64))("
    f"int64, int64[::1], {_FLOATS_3}, {_FLOATS_2}, {_FLOATS_3}, {_FLOATS_2}, float64[::1],"
    " float64[::1], float64[::1], int64[::1], boolean[:, ::1], float64, int64[:, ::1],"
    " int64[:, ::1], int64[::1], int64, int64, float64, float64)"
)
def _search(
    goal: int,
    kind: Numbers,
    leg: Floats,
    own: Floats,
    leg_draw: Floats,
    own_draw: Floats,
    ready: Floats,
    most: Floats,
    weight: Floats,
    priority: Numbers,
    able: NDArray[np.bool_],
    move: float,
    near: Numbers,
    order: Numbers,
    length: Numbers,
    seed: int,
    rounds: int,
    seconds: float,
    share: float,
) -> tuple[Numbers, Numbers, float, float, float, float]:
    """See `search`."""
    np.random.seed(seed)  # noqa: NPY002
    robots, tasks = len(kind), len(weight)
    holder = np.full(tasks, -1)
    for robot in range(robots):
        for place in range(length[robot]):
            holder[order[robot, place]] = robot
    facts = _Facts(
        goal, kind, leg, own, leg_draw, own_draw, ready, most, weight, priority, able, holder,
        move, near,
    )  # fmt: skip
    lists = _Lists(
        order,
        length,
        holder.copy(),
        np.zeros((robots, tasks + 2)),
        np.zeros((robots, tasks + 2)),
        np.zeros(robots),
        np.zeros(robots),
        np.zeros(robots, dtype=np.bool_),
        np.ones(robots, dtype=np.bool_),
    )
    for robot in range(robots):
        _renew(facts, lists, robot)
    before = lists.cost.sum() if length.sum() == tasks else np.inf
    left, looked = _auction(facts, lists)
    auctioned = lists.cost.sum()
    seconds = min(seconds, share * _mean_time(lists))
    best, lengths, spent = _improve(facts, lists, left, rounds, seconds)
    lists.order[:], lists.length[:] = best, lengths
    for robot in range(robots):
        _renew(facts, lists, robot)
    return best, lengths, before, auctioned, lists.cost.sum(), spent + PLACE_TIME * looked
