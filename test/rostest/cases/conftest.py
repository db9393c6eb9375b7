# SPDX-License-Identifier: BSD-3-Clause
"""What the cases share: the operator's program, and how a case of the test plan is written down.

A case of the test plan carries the mark `plan(case, asks, expected)`. It and what the case says it
has observed go into the results as properties, from which docs/test-plan.md is made.
"""

import sys
from itertools import product

import pytest
import rosgraph
import rospy
from hive_operator import ROBOTS, Operator
from launching import Launches, publishers_of, wait_until_empty

from hive_lab.live.connections import is_heard


def pytest_configure(config):
    """Register the mark."""
    config.addinivalue_line("markers", "plan(case, asks, expected): a case of docs/test-plan.md")


def pytest_runtest_logreport(report):
    """Report at once why a case failed: after the file's time limit nobody does."""
    if report.failed:
        sys.stdout.write(f"\n{report.longreprtext}\n")
        sys.stdout.flush()


@pytest.fixture(scope="session")
def operator():
    """The operator's program, once the fleet is there and connected.

    It listens only when all have told the master what they publish: rospy overlooks a publisher
    that registers at the same moment as a subscriber. A node that has overlooked one finds it a
    little later, so it posts nothing before every robot hears who may ask it for a bid, everybody
    who may ask hears the robots and their bids, and it hears all of them itself.
    """
    rospy.init_node("operator")
    speakers = dict.fromkeys(("/task_state", "/bb_backup", "/bb_sync"), len(ROBOTS) + 1)
    speakers |= dict.fromkeys(("/robot_status", "/task_cost"), len(ROBOTS))
    for robot in ROBOTS:
        speakers |= {f"/{robot}/ground_truth": 1, f"/{robot}/battery_state": 1}
    wait_until_empty(lambda: {t: n for t, n in speakers.items() if publishers_of(t) < n})
    operator = Operator()
    operator.expect(
        lambda: set(ROBOTS) <= set(operator.robots),
        f"a status of {', '.join(ROBOTS)}",
        lambda: sorted(operator.robots),
    )
    here, robots = rospy.get_name(), [f"/{robot}/robot" for robot in ROBOTS]
    members = ["/blackboard", *robots]
    links = [
        *product(members, ("/task_bc", "/task_assign"), robots),
        *product(robots, ("/task_cost", "/robot_status"), members),
        *product(robots, ("/task_cost", "/robot_status"), [here]),
        *product(members, ("/task_state", "/bb_sync", "/bb_backup"), [here]),
    ]
    for name in ROBOTS:
        links.append(("/simulator", f"/{name}/ground_truth", here))
        links.append((f"/{name}/robot", f"/{name}/battery_state", here))
        links.append((f"/{name}/move_base", f"/{name}/move_base/status", f"/{name}/robot"))
    wait_until_empty(lambda: [link for link in links if not is_heard(*link)])
    operator.hear_again(*ROBOTS)
    return operator


@pytest.fixture
def launches(tmp_path, monkeypatch):
    """What a case launches: with a disk of its own, and windows on an invisible screen."""
    monkeypatch.setenv("QT_QPA_PLATFORM", "offscreen")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    rosgraph.Master("/operator").setParam("/journal", str(tmp_path))
    launches = Launches()
    yield launches
    launches.stop()


@pytest.fixture(autouse=True)
def observed(request, record_property):
    """Return a function that records observations in words."""
    mark = request.node.get_closest_marker("plan")
    if mark is not None:
        case, asks, expected = mark.args
        record_property("case", case)
        record_property("asks", asks)
        record_property("expected", expected)
        record_property("file", request.node.path.name)
    return lambda text: record_property("observed", text)
