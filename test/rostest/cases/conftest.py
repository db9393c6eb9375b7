# SPDX-License-Identifier: BSD-3-Clause
"""What the cases share: the operator's program, and how a case of the test plan is written down.

A case of the test plan carries the mark `plan(case, asks, expected)`. It and what the case says it
has observed go into the results as properties, from which docs/test-plan.md is made.
"""

import time

import pytest
import rospy
from hive_operator import PATIENCE, ROBOTS, Operator
from launching import publishers_of

POLL = 0.2


def pytest_configure(config):
    """Make the mark known."""
    config.addinivalue_line("markers", "plan(case, asks, expected): a case of docs/test-plan.md")


@pytest.fixture(scope="session")
def operator():
    """The operator's program, once it has heard of every robot of the fleet.

    It listens only when all have told the master what they publish: rospy overlooks a publisher
    that registers at the same moment as a subscriber.
    """
    rospy.init_node("operator")
    members = len(ROBOTS) + 1
    speakers = {"/task_state": members, "/bb_backup": members, "/bb_sync": members}
    speakers |= {"/robot_status": len(ROBOTS), "/task_cost": len(ROBOTS)}
    speakers |= {f"/{robot}/ground_truth": 1 for robot in ROBOTS}
    end = time.monotonic() + PATIENCE
    while missing := {t: n for t, n in speakers.items() if publishers_of(t) < n}:
        assert time.monotonic() < end, f"too few publishers of {missing}"
        time.sleep(POLL)  # the master tells nobody what is new
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
