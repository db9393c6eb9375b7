# SPDX-License-Identifier: BSD-3-Clause
"""One hypothesis profile: the same examples in every run, on every machine; and `caught`."""

from pathlib import Path

import pytest
from hypothesis import settings

from hive_lab.fault_schedules.directed import DIRECTED
from hive_lab.fault_schedules.draw import draw
from hive_lab.fault_schedules.run import run

PAGE = Path(__file__).parents[2] / "docs/protocol.md"

settings.register_profile(
    "fixed", derandomize=True, database=None, deadline=None, max_examples=150, print_blob=False
)
settings.load_profile("fixed")


@pytest.fixture
def caught(monkeypatch):
    """Return a function that tells whether a mutation breaks a property that holds without it.

    It also fails when docs/protocol.md does not name that property.
    """

    def is_caught(mutate, known):
        """Run a schedule, known by name or by seed and scenario, without and with the mutation."""
        by_name = isinstance(known, str)
        schedule = DIRECTED[known] if by_name else draw(*known)
        assert run(schedule).violation == ""

        mutate(monkeypatch)
        violation = run(schedule).violation
        assert violation or by_name, f"{known} no longer catches it; {another_seed(known[1])} does"
        _, broken, _ = f"{violation}: : ".split(": ", 2)
        rule = mutate.__name__.replace("_", " ")
        where = known if by_name else " ".join(map(str, known)).strip()
        row = f"| {rule} | {where} | {broken} |"
        assert row in PAGE.read_text(encoding="utf-8").splitlines()
        return bool(violation)

    return is_caught


def another_seed(scenario):
    """Return the first seed whose schedule in a scenario breaks a property now."""
    broken = (seed for seed in range(300) if run(draw(seed, scenario)).violation)
    return next(broken, "none below 300")
