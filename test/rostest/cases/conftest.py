# SPDX-License-Identifier: BSD-3-Clause
"""What the cases share: the operator's program, and how a case of the test plan is written down.

A case of the test plan carries the mark `plan(case, asks, expected)`. It and what the case says it
has observed go into the results as properties, from which docs/test-plan.md is made.
"""

import pytest
import rospy
from hive_operator import ROBOTS, Operator


def pytest_configure(config):
    """Make the mark known."""
    config.addinivalue_line("markers", "plan(case, asks, expected): a case of docs/test-plan.md")


@pytest.fixture(scope="session")
def operator():
    """The operator's program, once it has heard of every robot of the fleet."""
    rospy.init_node("operator")
    operator = Operator()
    operator.expect(
        lambda: set(ROBOTS) <= set(operator.robots),
        f"a status of {', '.join(ROBOTS)}",
        lambda: sorted(operator.robots),
    )
    return operator


@pytest.fixture(autouse=True)
def observed(request, record_property):
    """Return a function that writes down what was observed, in words."""
    mark = request.node.get_closest_marker("plan")
    if mark is not None:
        case, asks, expected = mark.args
        record_property("case", case)
        record_property("asks", asks)
        record_property("expected", expected)
        record_property("file", request.node.path.name)
    return lambda text: record_property("observed", text)
