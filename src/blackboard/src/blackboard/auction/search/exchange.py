# SPDX-License-Identifier: BSD-3-Clause
"""One round of exchanges between robots, the step of the search.

Every robot of a group takes one bundle out of its list and offers it: one task, some consecutive
tasks, the rest of its list, or nothing. Every robot bids on every bundle for the best place in
what is left of its own list. The bundles are assigned, one to each robot, with the least sum of
bids (the assignment problem). As every robot may get its own bundle back at its old place, a round
never makes the plan worse.

Moving a task, swapping two, exchanging the ends of two lists (2-opt*) and passing tasks on in a
ring are all such rounds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from blackboard.auction.search.plan import cut_out, put_in, without
from blackboard.auction.search.timetable import Insertions, Timetable, make_bundles

if TYPE_CHECKING:
    from blackboard.auction.search.objectives import Objective
    from blackboard.auction.search.problem import Floats, Numbers
    from blackboard.auction.search.timetable import Book, Bundles

_REFUSED = 1e30  # above any bid; the assignment needs finite numbers


def best_places(
    table: Timetable, bundles: Bundles, objective: Objective
) -> tuple[Floats, Numbers]:
    """Return the marginal costs of bundles and their places, shaped (..., bundles, lists).

    Costs are infinite where refused; `table` is shaped (..., lists), `bundles` (..., bundles).
    """
    options = Insertions(table, bundles)
    scores = np.where(options.refused(), np.inf, objective(options))
    place = scores.argmin(axis=-1)
    best = np.take_along_axis(scores, place[..., None], axis=-1)[..., 0]
    return best - objective(table)[..., None, :], place


def exchange(
    book: Book,
    objective: Objective,
    robot: Numbers,
    order: Numbers,
    start: Numbers,
    size: Numbers,
    factor: Floats | float = 1.0,
) -> Numbers:
    """Hold one round of exchanges in each of several groups at once.

    Args:
        book: The figures.
        objective: What to minimise.
        robot: (groups, members) owner of each list.
        order: (groups, members, places) lists.
        start: (groups, members) place of the first task that each offers.
        size: (groups, members) number of tasks that each offers.
        factor: (groups, bundles, members) multiplies the bids before the assignment. With a factor
            other than 1, a round may make the plan worse.

    Returns:
        The new lists, (groups, members, places or more).
    """
    # Only a leader with a plan to improve needs it; it takes 10 MB.
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415

    nothing = book.nothing
    rest = without(order, start, size, nothing)
    bundles = make_bundles(book, cut_out(order, start, size, nothing))
    cost, place = best_places(Timetable(book, robot, rest), bundles, objective)
    cost = np.minimum(cost * factor, _REFUSED)
    groups, members = robot.shape
    takes = np.empty((groups, members), dtype=int)
    for group in range(groups):
        bundle, taker = linear_sum_assignment(cost[group])
        takes[group, taker] = bundle
    rows, columns = np.arange(groups)[:, None], np.arange(members)
    chosen = place[rows, takes, columns]
    if (cost[rows, takes, columns] >= _REFUSED).any():
        # Lists that are not allowed as they are may leave nothing that is: those groups stay.
        stay = (cost[rows, takes, columns] >= _REFUSED).any(axis=1, keepdims=True)
        takes, chosen = np.where(stay, columns, takes), np.where(stay, start, chosen)
    given = make_bundles(book, bundles.tasks[rows, takes])
    return put_in(rest, chosen, given, nothing)
