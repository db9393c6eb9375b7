# SPDX-License-Identifier: BSD-3-Clause
"""Runs a scenario on virtual time: the hive's real classes, and simulated robots that drive."""

from __future__ import annotations

import time
from datetime import datetime
from functools import partial
from typing import TYPE_CHECKING

from blackboard.domain.talker import ROBOT_STATUS, SYNC, TASK_STATE
from fleet_manager.client.hive_state import HiveState
from fleet_manager.client.reports import BatteryReading, Collisions, TruePlace
from fleet_manager.demo.history import History
from fleet_manager.demo.report import Clocks, make_report
from fleet_manager.demo.runner import DemoResult
from hive_common.pose import Pose
from hive_lab.fleets.simulated_bodies import SimulatedBodies
from hive_lab.fleets.virtual_fleet import VirtualFleet
from simenv.world.world_file import load_world

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fleet_manager.client.reports import Report
    from fleet_manager.config.fleet_file import Fleet
    from fleet_manager.config.scenario import Scenario
    from fleet_manager.demo.runner import Look
    from hive_lab.compare.experiment import Kill

WARM_UP = 2.5  # time in which every robot tells its status before the first task comes [s]
LOOK_EVERY = 0.5  # time between two looks at the robots [s]
TOO_LATE = "the time limit of {:g} s is over"


def run_virtual(
    fleet: Fleet, scenario: Scenario, seed: int, faults: Sequence[Kill], look: Look
) -> DemoResult:
    """Let a fleet do a scenario.

    Args:
        fleet: The robots, and how they decide.
        scenario: What is posted.
        seed: Of the simulation's noise.
        faults: Robots whose processes are killed.
        look: See `fleet_manager.demo.runner.DemoRun`.
    """
    return _VirtualRun(fleet, scenario, seed).run(faults, look)


class _VirtualRun:
    def __init__(self, fleet: Fleet, scenario: Scenario, seed: int) -> None:
        self._plan, self._scenario = fleet, scenario
        planned = fleet.traffic == "planned"
        models = [robot.model for robot in fleet.robots] if planned else []
        self._bodies = SimulatedBodies(scenario.world, seed, scenario.map, models, fleet.zones)
        places = fleet.chargers or load_world(scenario.world).chargers
        chargers = {place.name: Pose(*place.pose) for place in places}
        self._fleet = VirtualFleet(fleet, scenario.map, self._bodies, chargers)
        self._fleet.run(WARM_UP)
        self._state = HiveState()
        self._begin = self._fleet.network.now
        self._history = History(self._begin)
        for topic in (TASK_STATE, SYNC, ROBOT_STATUS):
            self._fleet.network.listen(topic, self._hear)

    def run(self, faults: Sequence[Kill], look: Look) -> DemoResult:
        date = datetime.now().astimezone().isoformat(timespec="seconds")
        wall, network = time.monotonic(), self._fleet.network
        for planned in self._scenario.tasks:
            network.schedule(planned.after, partial(self._fleet.post, planned.task))
        for fault in faults:
            network.schedule(fault.after, partial(self._fleet.kill, fault.kill))
        remarks = []
        tasks = len(self._scenario.tasks)
        while (ended := self._ended()) < tasks:
            if network.now - self._begin >= self._scenario.time_limit:
                remarks.append(TOO_LATE.format(self._scenario.time_limit))
                break
            self._fleet.run(LOOK_EVERY)
            self._observe()
            look(network.now - self._begin, ended / tasks)
        self._history.close(network.now)
        clocks = Clocks(date, 0.0, network.now - self._begin, time.monotonic() - wall)
        report = make_report(self._scenario, self._plan, self._state, self._history, clocks)
        return DemoResult(report, self._history, remarks)

    def _hear(self, report: Report) -> None:
        now = self._fleet.network.now
        self._history.add(now, report)
        self._state.take_in(report, now, now)

    def _observe(self) -> None:
        """Record what the simulation and the batteries tell."""
        simulation, now = self._bodies.simulation, self._fleet.network.now
        for name, battery in self._fleet.batteries.items():
            x, y, _ = simulation.poses[name]
            self._history.add(now, TruePlace(name, x, y))
            reading = BatteryReading(name, battery.get_volts(), battery.charge_left)
            self._history.add(now, reading)
        self._history.add(now, Collisions(simulation.collisions))

    def _ended(self) -> int:
        states = (self._state.state_of(planned.task.id) for planned in self._scenario.tasks)
        return sum(state is not None and state.is_terminal for state in states)
