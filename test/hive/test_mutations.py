# SPDX-License-Identifier: BSD-3-Clause
"""Without a rule of the protocol, or with a past mistake, a schedule breaks a property.

To see a schedule, run `python3 -m hive_lab.fault_schedules.run SEED --scenario SCENARIO`, over
Zenoh with `--transport zenoh`; the program as it is breaks no property there.
"""

from itertools import takewhile
from pathlib import Path

import pytest

from hive_lab.fault_schedules.draw import draw
from hive_lab.fault_schedules.mutations.search import MUTATIONS

LINES = (Path(__file__).parents[2] / "docs/protocol.md").read_text(encoding="utf-8").splitlines()
"""The page, which lists all mutations."""


def another_seed(mutation, *, zenoh):
    """Return the first seed that notices a mutation now."""
    drawn = ((seed, draw(seed, mutation.scenario, zenoh=zenoh)) for seed in range(300))
    return next((seed for seed, each in drawn if mutation.broken_in(each)), "none below 300")


LEFT_OUT = "| left out | caught by | what breaks |"
MISTAKES = "| schedule | what was wrong | put back by |"


def rows(head):
    """Return the rows of the page's table with a head, as tuples of cells."""
    begin = LINES.index(head) + 2
    table = takewhile(lambda line: line.startswith("|"), LINES[begin:])
    return [tuple(line.strip("| ").split(" | ")) for line in table]


def violation_of(mutation, known):
    """Return what a mutation breaks in the schedule that is known to notice it."""
    assert not mutation.broken_without(known)
    violation = mutation.broken_in(known)
    zenoh = known.site is not None
    assert violation, f"no longer there, but seed {another_seed(mutation, zenoh=zenoh)}"
    return violation


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.name)
def test_a_schedule_notices_the_mutation_and_the_page_says_so(mutation):
    violation = violation_of(mutation, mutation.schedule)

    _, broken, _ = violation.split(": ", 2)
    assert (mutation.name, mutation.where, broken) in rows(LEFT_OUT)


NOTICED = [each for each in MUTATIONS if each.schedule_over_zenoh is not None]
NOT_NOTICED = "Over Zenoh, no schedule is known that notices these:"
"""What the page says before the others."""


@pytest.mark.parametrize("mutation", NOTICED, ids=lambda mutation: mutation.name)
def test_over_zenoh_a_schedule_notices_the_mutation_too(mutation):
    known = mutation.schedule_over_zenoh

    assert known.site is not None
    assert violation_of(mutation, known)


def test_the_page_lists_what_no_schedule_over_zenoh_notices():
    listed = next(line for line in LINES if line.startswith(NOT_NOTICED))
    names = listed.removeprefix(NOT_NOTICED).strip(" .").split("; ")

    left = [each.name for each in MUTATIONS if each.schedule_over_zenoh is None]
    assert sorted(names) == sorted(left)


def test_the_page_lists_no_other_mutation():
    listed = [name for name, *_ in rows(LEFT_OUT)]

    assert sorted(listed) == sorted(each.name for each in MUTATIONS)


def test_the_page_lists_what_puts_each_past_mistake_back():
    listed = rows(MISTAKES)
    put_back = [(bug, name) for bug, _, name in listed if name != "none, see below"]

    assert sorted(put_back) == sorted((each.bug, each.name) for each in MUTATIONS if each.bug)
