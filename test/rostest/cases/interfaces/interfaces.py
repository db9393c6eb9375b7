# SPDX-License-Identifier: BSD-3-Clause
"""Messages, accepted parameters and what launch files start are as recorded.

The list is `interfaces.yaml`; `interface_list.py` says how to renew it. What can be read from
files is compared by `test/unit/test_interfaces.py`, running systems by the cases beside this one.
Each of them has a master of its own: a closed window does not always take its name off the master.
"""

import re
import subprocess

import pytest
import yaml
from interface_files import ROOT, message_definitions, package_of
from interface_list import check
from interface_nodes import MASTER, launched, md5sum_of

from hive_lab.runner.limits import PATIENCE

STRICT = ("amcl", "blackboard_node", "mapper", "move_base", "robot_node")
"""Executables that refuse a parameter that they do not know, and tell those that they do."""
LAUNCHED = (
    ("fleet_manager fleet_manager.launch", {}),
    ("fleet_manager robot.launch", {"name": "robot9", "model": "mir100", "sim": "false"}),
    ("simenv mapping.launch", {"rviz": "true", "teleop": "true", "sim": "false"}),
    ("simenv rviz.launch", {}),
    ("blackboard blackboard.launch", {"journal": "/j", "decision": "centralized"}),
    ("blackboard robot.launch", {"name": "robot9", "charge": "0.5", "stands_by": "false"}),
)

"""Launch files with arguments that none of the systems has that are started."""


def test_the_messages_have_the_md5sums_that_are_recorded():
    check("md5sums", {name: md5sum_of(name) for name in message_definitions()})


@pytest.fixture
def refusals():
    """Return what the strict executables say to a parameter that none of them knows."""
    (model,) = ROOT.glob("src/*/models/mir100.yaml")
    MASTER.setParam("/robot1/characteristics", yaml.safe_load(model.read_text(encoding="utf-8")))
    started = {
        name: subprocess.Popen(
            ["rosrun", package_of(name), name, "__ns:=/robot1", "_no_such_parameter:=1"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        for name in STRICT
    }
    try:
        yield {name: each.communicate(timeout=PATIENCE)[0] for name, each in started.items()}
    finally:
        for each in started.values():
            each.kill()
            each.communicate()


def test_the_nodes_accept_the_parameters_that_are_recorded(refusals):
    allowed = {name: re.search(r"allowed: ([\w, ]+)", text) for name, text in refusals.items()}
    check("accepted parameters", {n: a[1].split(", ") if a else [] for n, a in allowed.items()})


def test_the_launch_files_start_the_nodes_that_are_recorded():
    check("launched", dict(launched(file, arguments) for file, arguments in LAUNCHED))
