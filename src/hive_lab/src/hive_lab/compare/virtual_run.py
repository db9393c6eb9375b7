# SPDX-License-Identifier: BSD-3-Clause
"""Makes a run of an experiment on virtual time: the real classes, and simulated robots."""

from __future__ import annotations

import time
from datetime import datetime
from functools import partial
from typing import TYPE_CHECKING, cast

from blackboard.consensus.task_list import TaskList
from blackboard.domain.talker import NEW_TASK, ROBOT_STATUS, SYNC, TASK_STATE
from blackboard.domain.task import Task
from fleet_manager.client.comparison import BLACKBOARD
from fleet_manager.client.hive_state import HiveState
from fleet_manager.client.reports import BatteryReading, Collisions, TruePlace
from fleet_manager.demo.history import History, TaskTimes
from fleet_manager.demo.report import Clocks, make_report
from fleet_manager.demo.runner import DemoResult
from hive_lab.architectures.kinds import BUILDERS
from hive_lab.compare.simulated_trial import SimulatedTrial

if TYPE_CHECKING:
    from fleet_manager.client.reports import Report
    from fleet_manager.demo.runner import Look
    from hive_lab.compare.experiment import Experiment, Fault, Variant
    from hive_lab.fault_schedules.faulty_network import Host

LOOK_EVERY = 0.5  # time between two looks at the robots [s]
TOO_LATE = "the time limit of {:g} s is over"

_HEARD = {TASK_STATE, SYNC, ROBOT_STATUS, NEW_TASK}
_AFTERWARDS = 60.0  # how much longer tasks that are done again are waited for [s]


def run_virtual(experiment: Experiment, variant: Variant, seed: int, look: Look) -> DemoResult:
    """Let a fleet work through an experiment.

    The report counts in `done_twice` the tasks that robots have really done more than once.

    Args:
        experiment: What is posted, and what goes wrong.
        variant: How it is decided.
        seed: Of the load, the simulation's noise and the network.
        look: See `fleet_manager.demo.runner.DemoRun`.
    """
    return _VirtualRun(experiment, variant, seed).run(look)


class _VirtualRun:
    def __init__(self, experiment: Experiment, variant: Variant, seed: int) -> None:
        self._experiment = experiment
        self._plan = experiment.fleet_of(variant)
        self._scenario = experiment.scenario_of(seed)
        self._trial = SimulatedTrial(self._plan, self._scenario, seed, experiment.loss)
        self._architecture = BUILDERS[variant.architecture](self._trial)
        self._trial.begin(self._architecture)
        self._state = HiveState()
        self._network = self._trial.network
        self._begin = self._network.now
        self._history = History(self._begin)

    def run(self, look: Look) -> DemoResult:
        date = datetime.now().astimezone().isoformat(timespec="seconds")
        wall, network, scenario = time.monotonic(), self._network, self._scenario
        network.said = self._hear
        for fault in self._experiment.faults:
            network.schedule(fault.after, None, partial(self._strike, fault))
        remarks = []
        tasks = len(scenario.tasks)
        while (ended := self._ended()) < tasks:
            now = network.now - self._begin
            if now >= scenario.time_limit:
                remarks.append(TOO_LATE.format(scenario.time_limit))
                break
            network.run(network.now + LOOK_EVERY)
            self._observe()
            look(now, ended / tasks)
        self._history.close(network.now)
        clocks = Clocks(date, 0.0, network.now - self._begin, time.monotonic() - wall)
        report = make_report(scenario, self._plan, self._state, self._history, clocks)
        network.said = lambda *_: None
        if self._experiment.faults or self._experiment.loss:
            network.run(network.now + _AFTERWARDS)
        report["done_twice"] = self._trial.ledger.done_twice
        return DemoResult(report, self._history, remarks)

    def _strike(self, fault: Fault, _: object) -> None:
        """Let a process fail."""
        hosts, name = self._network.hosts, fault.process
        if name == BLACKBOARD and BLACKBOARD not in hosts:
            name = self._architecture.coordinator
        if fault.seconds is not None:
            self._trial.freeze(name, fault.seconds)
        elif hosts[name].up:
            self._trial.kill(name)

    def _hear(self, _sender: Host, topic: str, message: object) -> None:
        """Record what anybody says: whoever watches a fleet loses no message."""
        if topic not in _HEARD:
            return
        report, now = cast("Report", message), self._network.now
        if isinstance(report, Task):  # it counts from then on, even if nobody has heard it
            self._history.tasks.setdefault(report.id, TaskTimes(posted=now - self._begin))
        elif topic != ROBOT_STATUS:  # what batteries have left is known better
            self._history.add(now, report)
        if isinstance(report, TaskList):
            parts = (record.task for record in report.records if record.parent)
            self._trial.ledger.learn_parts(parts)
        self._state.take_in(report, now, now)

    def _observe(self) -> None:
        """Record what the simulation and the batteries tell."""
        simulation, now = self._trial.simulation, self._network.now
        for name, robot in self._trial.robots.items():
            x, y, _ = simulation.poses[name]
            self._history.add(now, TruePlace(name, x, y))
            battery = robot.body.battery
            reading = BatteryReading(name, battery.get_volts(), battery.charge_left)
            self._history.add(now, reading)
            self._history.tracks[name].charges.append((now - self._begin, battery.level))
        self._history.add(now, Collisions(simulation.collisions))

    def _ended(self) -> int:
        states = (self._state.state_of(planned.task.id) for planned in self._scenario.tasks)
        return sum(state is not None and state.is_terminal for state in states)
