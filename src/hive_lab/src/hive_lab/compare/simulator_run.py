# SPDX-License-Identifier: BSD-3-Clause
"""Runs a scenario as a whole system on ROS: every node, as `hive demo` does."""

from __future__ import annotations

import contextlib
import math
import os
import signal
from typing import TYPE_CHECKING

import yaml

from fleet_manager.client.comparison import BLACKBOARD
from fleet_manager.config.fleet_file import read_fleet
from fleet_manager.demo.local_hive import local_hive
from fleet_manager.demo.runner import DemoPlan, run_demo
from fleet_manager.ros.command_line import connect
from hive_common.resources import beside

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

    from fleet_manager.config.fleet_file import Fleet
    from fleet_manager.demo.local_hive import LocalHive
    from fleet_manager.demo.runner import DemoResult, Look
    from hive_lab.compare.experiment import Experiment, Fault, Variant


def run_in_simulator(
    experiment: Experiment, variant: Variant, seed: int, look: Look, folder: Path
) -> DemoResult:
    """Let a fleet work through an experiment; logs and the run's fleet file go into a folder.

    This process may connect to no other hive before or after it.

    Args:
        experiment: What is posted, and what goes wrong.
        variant: How the hive decides.
        seed: Of the load.
        look: See `fleet_manager.demo.runner.DemoRun`.
        folder: An empty folder.

    Raises:
        StartError: The hive did not start, or a process ended unexpectedly.
    """
    fleet = write_fleet(experiment.fleet_of(variant), folder, each=bool(experiment.faults))
    scenario = experiment.scenario_of(seed)
    plan = DemoPlan(scenario, fleet, experiment.rtf, windows=False)
    with (
        local_hive(folder) as hive,
        (folder / "run.log").open("w", encoding="utf-8") as sink,
        Faults(experiment.faults, hive) as faults,
    ):

        def see(now: float, ended: float) -> None:
            faults.look(now)
            look(now, ended)

        return run_demo(plan, hive, connect, sink, see)


class Faults(contextlib.AbstractContextManager["Faults"]):
    """Kills and freezes processes of a hive when they are due; at the end, all go on.

    Args:
        faults: What fails when.
        hive: Whose processes they are.
        signal_to: Sends a signal to a process.
    """

    def __init__(
        self,
        faults: Iterable[Fault],
        hive: LocalHive,
        signal_to: Callable[[int, int], None] = os.kill,
    ) -> None:
        self._due = sorted(faults, key=lambda fault: fault.after)
        self._hive = hive
        self._signal_to = signal_to
        self._frozen: list[tuple[float, int]] = []  # until when [s], and the process

    def __exit__(self, *_: object) -> None:
        """Let what stands still go on: a process that stands still does not end."""
        self.look(math.inf)

    def look(self, now: float) -> None:
        """Let fail what fails until now, and go on what has stood still for long enough [s]."""
        while self._due and self._due[0].after <= now < math.inf:
            fault = self._due.pop(0)
            process = self._process(fault.process)
            if fault.seconds is None:
                self._send(process, signal.SIGKILL)
            else:
                self._frozen.append((fault.after + fault.seconds, process))
                self._send(process, signal.SIGSTOP)
        for until, process in [each for each in self._frozen if each[0] <= now]:
            self._frozen.remove((until, process))
            self._send(process, signal.SIGCONT)

    def _process(self, who: str) -> int:
        return self._hive.process_of(f"/{BLACKBOARD}" if who == BLACKBOARD else f"/{who}/robot")

    def _send(self, process: int, number: int) -> None:
        with contextlib.suppress(ProcessLookupError):
            self._signal_to(process, number)


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
