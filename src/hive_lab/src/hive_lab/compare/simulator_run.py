# SPDX-License-Identifier: BSD-3-Clause
"""Runs a scenario as a whole system on ROS: every node, as `hive demo` does."""

from __future__ import annotations

import contextlib
import os
import signal
from typing import TYPE_CHECKING

import yaml

from fleet_manager.config.fleet_file import read_fleet
from fleet_manager.demo.local_hive import local_hive
from fleet_manager.demo.runner import DemoPlan, run_demo
from fleet_manager.ros.command_line import connect
from hive_common.resources import beside
from hive_lab.compare.experiment import BLACKBOARD

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from fleet_manager.config.fleet_file import Fleet
    from fleet_manager.config.scenario import Scenario
    from fleet_manager.demo.local_hive import LocalHive
    from fleet_manager.demo.runner import DemoResult, Look
    from hive_lab.compare.experiment import Kill


def run_in_simulator(
    fleet: Fleet,
    scenario: Scenario,
    rtf: float,
    faults: Sequence[Kill],
    look: Look,
    folder: Path,
) -> DemoResult:
    """Let a fleet do a scenario; logs and the fleet file of the run go into a folder.

    This process may connect to no other hive before or after it.

    Args:
        fleet: The robots, and how they decide.
        scenario: What is posted.
        rtf: The requested real-time factor.
        faults: Processes that are killed.
        look: See `fleet_manager.demo.runner.DemoRun`.
        folder: An empty folder.

    Raises:
        StartError: The hive did not start, or a process ended unexpectedly.
    """
    plan = DemoPlan(scenario, write_fleet(fleet, folder, each=bool(faults)), rtf, windows=False)
    due = sorted(faults, key=lambda fault: fault.after)
    with (
        local_hive(folder) as hive,
        (folder / "run.log").open("w", encoding="utf-8") as sink,
    ):

        def see(now: float, ended: float) -> None:
            while due and due[0].after <= now:
                _kill(hive, due.pop(0).kill)
            look(now, ended)

        return run_demo(plan, hive, connect, sink, see)


def write_fleet(fleet: Fleet, folder: Path, *, each: bool) -> Fleet:
    """Write a fleet file with a fleet's way to decide, and read it.

    Args:
        fleet: A fleet whose `decision` and `cost_model` differ from those of its file.
        folder: Where the file is written.
        each: Whether each node of a robot has a process of its own.
    """
    content = yaml.safe_load(fleet.path.read_text(encoding="utf-8"))
    content |= {"decision": fleet.decision, "cost_model": fleet.cost_model}
    if each:
        content["processes"] = "each"
    for robot in content["robots"]:
        robot["model"] = beside(fleet.path, robot["model"])
    path = folder / "fleet.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return read_fleet(str(path))


def _kill(hive: LocalHive, who: str) -> None:
    node = f"/{BLACKBOARD}" if who == BLACKBOARD else f"/{who}/robot"
    with contextlib.suppress(ProcessLookupError):
        os.kill(hive.process_of(node), signal.SIGKILL)
