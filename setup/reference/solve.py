# SPDX-License-Identifier: BSD-3-Clause
"""Solves exported instances with OR-Tools and PyVRP, and writes the best figures found.

setup/reference/make runs this in a virtual environment of its own. Both solvers need whole
numbers, so lengths are in centimetres here. The figures are computed from the lists in metres,
which are seconds at 1 m/s.
"""

from __future__ import annotations

import json
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pyvrp
import pyvrp.stop
from ortools.constraint_solver import pywrapcp, routing_enums_pb2

CENTIMETRES = 100
OBJECTIVES = ("latency", "makespan", "energy")
SECONDS = {10: 1, 20: 8, 100: 20, 1000: 60}
"""Time limit of each solver on each instance and objective, by the number of tasks [s]."""


class Instance:
    """An exported instance, as a routing problem whose routes may end anywhere.

    Nodes are numbered: tasks, then the robots' positions, then the common end of all routes.
    """

    def __init__(self, path: Path) -> None:
        with np.load(path) as file:
            self.way, self.inner = file["way"], file["inner"]
        self.tasks = self.inner.size
        self.robots = self.way.shape[0] - self.tasks
        self.end = self.tasks + self.robots
        cost = np.zeros((self.end + 1, self.end + 1))
        cost[: self.end, : self.tasks] = self.way + self.inner
        self.cost = np.rint(cost * CENTIMETRES).astype(int)

    def figures(self, lists: list[list[int]]) -> dict[str, float]:
        """Return the figures of lists by objective [m] or [s]."""
        if sorted(task for row in lists for task in row) != list(range(self.tasks)):
            raise ValueError("a solver lost a task or assigned it twice")
        done = [self._done(robot, row) for robot, row in enumerate(lists)]
        ends = [times[-1] for times in done if times]
        return {
            "latency": sum(map(sum, done)) / self.tasks,
            "makespan": max(ends),
            "energy": sum(ends),
        }

    def _done(self, robot: int, row: list[int]) -> list[float]:
        here, clock, times = self.tasks + robot, 0.0, []
        for task in row:
            clock += float(self.way[here, task] + self.inner[task])
            here = task
            times.append(clock)
        return times


def by_ortools(instance: Instance, objective: str, seconds: int) -> list[list[int]] | None:
    """Return the lists that OR-Tools finds, or None."""
    ends = [instance.end] * instance.robots
    starts = list(range(instance.tasks, instance.end))
    manager = pywrapcp.RoutingIndexManager(instance.end + 1, instance.robots, starts, ends)
    routing = pywrapcp.RoutingModel(manager)
    transit = routing.RegisterTransitMatrix(instance.cost.tolist())
    routing.SetArcCostEvaluatorOfAllVehicles(
        transit
        if objective == "energy"
        else routing.RegisterTransitMatrix((instance.cost * 0).tolist())
    )
    horizon = int(instance.cost.max()) * instance.tasks
    routing.AddDimension(transit, 0, horizon, True, "time")
    time = routing.GetDimensionOrDie("time")
    if objective == "makespan":
        time.SetGlobalSpanCostCoefficient(100)
        routing.SetArcCostEvaluatorOfAllVehicles(transit)
    if objective == "latency":
        for task in range(instance.tasks):
            time.SetCumulVarSoftUpperBound(manager.NodeToIndex(task), 0, 1)
    search = pywrapcp.DefaultRoutingSearchParameters()
    search.first_solution_strategy = (
        routing_enums_pb2.FirstSolutionStrategy.PARALLEL_CHEAPEST_INSERTION
    )
    search.local_search_metaheuristic = (
        routing_enums_pb2.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    )
    search.time_limit.seconds = seconds
    found = routing.SolveWithParameters(search)
    if found is None:
        return None
    lists = []
    for robot in range(instance.robots):
        index, row = found.Value(routing.NextVar(routing.Start(robot))), []
        while not routing.IsEnd(index):
            row.append(manager.IndexToNode(index))
            index = found.Value(routing.NextVar(index))
        lists.append(row)
    return lists


def by_pyvrp(instance: Instance, seconds: int) -> list[list[int]] | None:
    """Return the lists with the shortest paths that PyVRP finds, or None."""
    model = pyvrp.Model()
    places = [model.add_location(0, 0) for _ in range(instance.end + 1)]
    for place in places[: instance.tasks]:
        model.add_client(place)
    depots = [model.add_depot(place) for place in places[instance.tasks :]]
    for depot in depots[:-1]:
        model.add_vehicle_type(1, start_depot=depot, end_depot=depots[-1])
    for here, row in zip(places, instance.cost.tolist(), strict=True):
        for there, length in zip(places, row, strict=True):
            if here is not there:
                model.add_edge(here, there, distance=length)
    found = model.solve(stop=pyvrp.stop.MaxRuntime(seconds), display=False)
    if not found.is_feasible():
        return None
    lists: list[list[int]] = [[] for _ in range(instance.robots)]
    for route in found.best.routes():
        visits = (activity for activity in route if activity.is_client())
        lists[route.vehicle_type()] = [activity.idx for activity in visits]
    return lists


def solve(path: Path) -> dict[str, dict[str, float]]:
    """Return the figures that each solver reaches, by objective."""
    instance = Instance(path)
    seconds = SECONDS[instance.tasks]
    found: dict[str, dict[str, float]] = {}
    for objective in OBJECTIVES:
        solvers = {"ortools": lambda wanted=objective: by_ortools(instance, wanted, seconds)}
        if objective == "energy":
            solvers["pyvrp"] = lambda: by_pyvrp(instance, seconds)
        for solver, run in solvers.items():
            lists = run()
            if lists is not None:
                value = instance.figures(lists)[objective]
                found.setdefault(objective, {})[solver] = round(value, 3)
    return found


def main(folder: Path, table: Path) -> None:
    """Solve every instance of a folder and write the table."""
    figures = {}
    for path in sorted(folder.glob("*.npz"), key=lambda path: path.stat().st_size):
        name = path.stem.replace("_", "/")
        figures[name] = solve(path)
        sys.stderr.write(f"{name} {figures[name]}\n")
        made = {
            "made_with": {name: version(name) for name in ("ortools", "pyvrp")},
            "seconds": {str(tasks): limit for tasks, limit in SECONDS.items()},
            "figures": figures,
        }
        table.write_text(json.dumps(made, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
