# SPDX-License-Identifier: BSD-3-Clause
"""Without a rule of the protocol, or with a past mistake, a schedule breaks a property.

To see a schedule, run `python3 -m hive_lab.fault_schedules.run SEED --scenario SCENARIO`; the
program as it is breaks no property there.
"""

import re
from pathlib import Path

import pytest

from hive_lab.fault_schedules.draw import draw
from hive_lab.fault_schedules.mutations.search import MUTATIONS

LINES = (Path(__file__).parents[2] / "docs/protocol.md").read_text(encoding="utf-8").splitlines()
"""The page, which lists all mutations."""


def another_seed(mutation):
    """Return the first seed that notices a mutation now."""
    drawn = ((seed, draw(seed, mutation.scenario)) for seed in range(300))
    return next((seed for seed, each in drawn if mutation.broken_in(each)), "none below 300")


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.name)
def test_a_schedule_notices_the_mutation_and_the_page_says_so(mutation):
    known = mutation.schedule
    assert not mutation.broken_without(known)

    violation = mutation.broken_in(known)

    by_name = isinstance(mutation.noticed_by, str)
    assert violation or by_name, f"{mutation.where} no longer, but seed {another_seed(mutation)}"
    assert violation
    _, broken, _ = violation.split(": ", 2)
    assert f"| {mutation.name} | {mutation.where} | {broken} |" in LINES


def test_the_page_lists_what_puts_each_past_mistake_back():
    rows = filter(None, (re.fullmatch(r"\| ([^|]+) \| [^|]+ \| ([^|]+) \|", e) for e in LINES))
    listed = {(row[1], row[2]) for row in rows}
    missing = {(each.bug, each.name) for each in MUTATIONS if each.bug} - listed

    assert not missing
