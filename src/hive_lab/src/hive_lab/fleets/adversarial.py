# SPDX-License-Identifier: BSD-3-Clause
"""Small places that are hard for traffic: lanes one robot wide, bays, junctions and dead ends.

Each is drawn from a seed, with two to six robots. A complete search over its cells tells that all
robots can get to their goals, so a fleet that does not has locked up.
"""

from __future__ import annotations

import math
import random
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_common.compiled import compiled
from hive_lab.fleets.coordination import CoordinatorMaker
from hive_lab.fleets.crowd import robot_name
from hive_lab.fleets.sites import WALL, drawn_site
from hive_lab.fleets.traffic import Traffic
from hive_navigation.control.goal_tracker import StuckDetector
from robot_description.models import load_model
from simenv.simulation import Simulation

if TYPE_CHECKING:
    from hive_common.geometry import Indices
    from hive_lab.fleets.sites import Box, Site

MODEL = "ld60"
CELL = 1.3  # side of a cell [m]: one robot fits, two beside each other do not
WITHIN = 300.0  # a fleet that takes longer has not solved its layout [s]

ROBOTS = (2, 6)  # least and most robots
LANE = (4, 9)  # length of the first lane [cells]
ARMS = (1, 4)  # how many bays and branches it gets
ARM = (1, 1, 1, 2, 3, 4)  # length of one [cells]
LOOPS = 0.15  # the share of arms that may lead back into the layout
IDLE = 0.2  # the share of robots without a goal
STATES = 4_000_000  # most ways to put the robots on the cells, so that the search is complete
MOVES = 60  # a layout that needs more moves of one robot takes too long

Cell = tuple[int, int]  # row and column
SIDES = ((0, 1), (1, 0), (0, -1), (-1, 0))


class Layout(NamedTuple):
    """A place of cells, and what robots are to do in it.

    Attributes:
        cells: The free ones, in order.
        starts: Of each robot, an index of a cell.
        goals: Of each robot, an index of a cell; -1 for one without a goal.
    """

    cells: tuple[Cell, ...]
    starts: tuple[int, ...]
    goals: tuple[int, ...]

    def __str__(self) -> str:
        """Return a map: `a` where the first robot starts, `A` where it is to go."""
        rows, columns = (max(cell[k] for cell in self.cells) + 1 for k in (0, 1))
        drawn = [["#"] * columns for _ in range(rows)]
        for k, (row, column) in enumerate(self.cells):
            small = [chr(97 + robot) for robot, start in enumerate(self.starts) if start == k]
            large = [chr(65 + robot) for robot, goal in enumerate(self.goals) if goal == k]
            drawn[row][column] = "".join(small + large) or "."
        return "\n".join(" ".join(f"{each:2}" for each in row) for row in drawn)


class Solved(NamedTuple):
    """How a fleet did in a layout.

    Attributes:
        reached: How many robots have got to their goals.
        asked: How many have one.
        took: Until the last one did [s].
        longest_stand: For which a robot with a goal stood still [s].
        contacts: How many there were.
        locks: How many the traffic planner has found.
    """

    reached: int
    asked: int
    took: float
    longest_stand: float
    contacts: int
    locks: int


def layout_of(text: str) -> Layout:
    """Return a layout from a map as `str` writes it.

    Robots are ordered by their letters; one without a capital letter has no goal.
    """
    cells: list[Cell] = []
    starts: dict[str, int] = {}
    goals: dict[str, int] = {}
    for row, line in enumerate(text.strip().splitlines()):
        for column, word in enumerate(line.split()):
            if word == "#":
                continue
            starts |= {letter: len(cells) for letter in word if letter.islower()}
            goals |= {letter.lower(): len(cells) for letter in word if letter.isupper()}
            cells.append((row, column))
    names = sorted(starts)
    return Layout(
        tuple(cells),
        tuple(starts[name] for name in names),
        tuple(goals.get(name, -1) for name in names),
    )


def draw(seed: int) -> Layout:
    """Return the layout of a seed, which a complete search has solved."""
    chance = random.Random(seed)
    while True:
        cells = _drawn_cells(chance)
        robots = chance.randint(*ROBOTS)
        if len(cells) <= robots or len(cells) ** robots > STATES:
            continue
        starts = chance.sample(range(len(cells)), robots)
        goals = chance.sample(range(len(cells)), robots)
        goals = [-1 if chance.random() < IDLE else goal for goal in goals]
        layout = Layout(cells, tuple(starts), tuple(goals))
        if 0 < least_moves(layout) <= MOVES:
            return layout


def _drawn_cells(chance: random.Random) -> tuple[Cell, ...]:
    """Return a lane with bays and branches, as cells from (0, 0) on."""
    cells: set[Cell] = {(0, column) for column in range(chance.randint(*LANE))}
    for _ in range(chance.randint(*ARMS)):
        row, column = chance.choice(sorted(cells))
        down, right = chance.choice(SIDES)
        may_loop = chance.random() < LOOPS
        for k in range(1, chance.choice(ARM) + 1):
            cell = (row + k * down, column + k * right)
            before = (cell[0] - down, cell[1] - right)
            beside = [other for other in _beside(cell) if other in cells and other != before]
            if cell in cells or (beside and not may_loop):
                break
            cells.add(cell)
    top, left = (min(cell[k] for cell in cells) for k in (0, 1))
    return tuple(sorted((row - top, column - left) for row, column in cells))


def _beside(cell: Cell) -> list[Cell]:
    return [(cell[0] + down, cell[1] + right) for down, right in SIDES]


def least_moves(layout: Layout) -> int:
    """Return how many moves of one robot to a free cell beside it lead all to their goals.

    The search is complete: it is breadth-first over all ways to put the robots on the cells.

    Returns:
        The least number of moves; -1 if there is no solution.
    """
    number = {cell: k for k, cell in enumerate(layout.cells)}
    beside = np.full((len(number), len(SIDES)), -1, dtype=np.int64)
    for cell, k in number.items():
        for side, other in enumerate(_beside(cell)):
            beside[k, side] = number.get(other, -1)
    ends = np.array(layout.starts, dtype=np.int64), np.array(layout.goals, dtype=np.int64)
    return int(breadth_first(beside, *ends))


@compiled("int64(int64[:, ::1], int64[::1], int64[::1])")
def breadth_first(beside: Indices, starts: Indices, goals: Indices) -> int:
    """Search all states; see `least_moves`.

    Args:
        beside: (cells, 4) the cells beside each; -1 for a wall.
        starts: (robots,)
        goals: (robots,)
    """
    count, robots = len(beside), len(starts)
    places = np.ones(robots, dtype=np.int64)  # what a robot's cell counts in the state's number
    for robot in range(1, robots):
        places[robot] = places[robot - 1] * count
    seen = np.zeros(places[-1] * count, dtype=np.bool_)
    queue = np.empty(len(seen), dtype=np.int64)
    queue[0] = (starts * places).sum()
    seen[queue[0]] = True
    at = np.empty(robots, dtype=np.int64)
    first, last, moves = 0, 1, 0
    while first < last:  # a round for each number of moves
        end = last
        for k in range(first, end):
            state = queue[k]
            done = True
            for robot in range(robots):
                at[robot] = state // places[robot] % count
                done = done and (goals[robot] < 0 or at[robot] == goals[robot])
            if done:
                return moves
            for robot in range(robots):
                for side in range(beside.shape[1]):
                    there = beside[at[robot], side]
                    if there < 0 or (at == there).any():
                        continue
                    after = state + (there - at[robot]) * places[robot]
                    if not seen[after]:
                        seen[after] = True
                        queue[last] = after
                        last += 1
        first = end
        moves += 1
    return -1


def site_of(layout: Layout) -> Site:
    """Return the layout as a place for simulated robots."""
    rows, columns = (max(cell[k] for cell in layout.cells) + 1 for k in (0, 1))
    free = set(layout.cells)
    walls: list[Box] = []
    for row in range(rows):
        begin = 0
        for column in range(columns + 1):
            if column == columns or (row, column) in free:
                if begin < column:
                    walls.append(_box(row, begin, column))
                begin = column + 1
    size = (columns * CELL + 2 * WALL, rows * CELL + 2 * WALL)
    return drawn_site("adversarial layout", size, walls, room=CELL / 2 - WALL)


def _box(row: int, begin: int, end: int) -> Box:
    """Return the box of some cells of a row, from one column to before another one."""
    low = WALL + CELL * row
    return (WALL + CELL * begin, low, WALL + CELL * end, low + CELL)


def drive(layout: Layout, seed: int) -> Solved:
    """Let a fleet with a traffic planner drive in a layout; `seed` is of everything random."""
    site = site_of(layout)
    chance = random.Random(seed)
    simulation = Simulation(site.world, seed=seed)
    coordinator = CoordinatorMaker(site, (MODEL,)).coordinator()
    traffic = Traffic(simulation, site.grid, coordinator)
    goals = {}
    for robot, (start, end) in enumerate(zip(layout.starts, layout.goals, strict=True)):
        name = robot_name(robot)
        traffic.add(name, load_model(MODEL), _pose(layout.cells[start], chance))
        if end >= 0:
            goals[name] = _pose(layout.cells[end], chance)
    for name, goal in goals.items():
        traffic.send(name, goal)
    stuck = {name: StuckDetector() for name in goals}
    longest = 0.0
    while (driving := goals.keys() - traffic.outcomes) and simulation.time < WITHIN:
        traffic.step()
        for name in driving:
            stuck[name].update(simulation.time, simulation.poses[name])
            longest = max(longest, stuck[name].duration(simulation.time))
    return Solved(
        sum(outcome.reached for outcome in traffic.outcomes.values()),
        len(goals),
        simulation.time,
        longest,
        len(simulation.contacts),
        coordinator.watch.counts.total(),
    )


def _pose(cell: Cell, chance: random.Random) -> tuple[float, float, float]:
    """Return the middle of a cell with a random heading, frame map."""
    x, y = (WALL + CELL * (cell[k] + 0.5) for k in (1, 0))
    return x, y, chance.uniform(-math.pi, math.pi)
