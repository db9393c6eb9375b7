# SPDX-License-Identifier: BSD-3-Clause
"""Reads experiments: which fleet does which tasks, and which ways to decide are compared.

The files in `experiments/` of fleet_manager are the manual of the format.
"""

import itertools
from pathlib import Path
from typing import Annotated

import attrs

from blackboard.costing.cost import COST_MODELS
from blackboard.domain.settings import DECISIONS
from fleet_manager.client.comparison import ARCHITECTURES, BLACKBOARD, HIVE, MOST_LOSS, RUN_ON
from fleet_manager.config.fleet_file import Fleet, read_fleet
from fleet_manager.config.load import Load
from fleet_manager.config.places import places_of
from fleet_manager.config.scenario import Scenario, read_scenario
from hive_common.checked_yaml import error_at, named_at, read_checked
from hive_common.map_file import load_map
from hive_common.resources import beside, find_file
from hive_common.structuring import (
    Allowed,
    NotAllowedError,
    between,
    listed,
    one_of,
    positive,
)

_WHO = "the name of a robot, or blackboard"


@attrs.frozen(kw_only=True)
class Fault:
    """A process that is killed, or stands still for a while.

    Raises:
        NotAllowedError: It is neither or both.
    """

    after: Annotated[float, between(0, 86400, "a number of seconds")]
    """From the first posting, on the hive's clock [s]."""
    kill: Annotated[str, Allowed(_WHO)] = ""
    """Whose process is killed; or `freeze`."""
    freeze: Annotated[str, Allowed(_WHO)] = ""
    """Whose process stands still; or `kill`."""
    seconds: Annotated[float, positive("a number of seconds", 86400)] | None = None
    """With `freeze`: for how long, on the hive's clock [s]."""

    def __attrs_post_init__(self) -> None:
        if bool(self.kill) is bool(self.freeze):
            raise NotAllowedError((), "give either kill or freeze")
        if bool(self.freeze) is (self.seconds is None):
            raise NotAllowedError(
                ("seconds",), "give it with freeze, for how long, and not with kill"
            )

    @property
    def process(self) -> str:
        """Whose process it is: a robot, or the blackboard."""
        return self.kill or self.freeze


@attrs.frozen(kw_only=True)
class _Content:
    """What an experiment file holds.

    Raises:
        NotAllowedError: It has both a scenario and a load, or neither.
    """

    description: str = ""
    """What the experiment is for, in a sentence."""
    fleet: Annotated[str, Allowed("the name or path of a fleet file")]
    scenario: Annotated[str, Allowed("the name or path of a scenario")] | None = None
    """What is posted; or `load`."""
    load: Load | None = None
    """Random tasks, drawn anew for each seed; or `scenario`."""
    world: Annotated[str, Allowed("the name or path of a world")] | None = None
    """None: the scenario's; with a load it is needed."""
    map: Annotated[str, Allowed("the name or path of a map")] | None = None
    """What the robots know of the world; None: the scenario's, or that of the world."""
    architectures: Annotated[
        tuple[Annotated[str, one_of(*ARCHITECTURES)], ...], listed("architectures", unique=True)
    ] = ()
    """How the fleet manager is built; none: the hive."""
    decisions: Annotated[
        tuple[Annotated[str, one_of(*DECISIONS)], ...], listed("decisions", unique=True)
    ] = ()
    """Who decides in the hive; none: as the fleet file says."""
    cost_models: Annotated[
        tuple[Annotated[str, one_of(*COST_MODELS)], ...], listed("cost models", unique=True)
    ] = ()
    """How robots reckon what a task costs; none: as the fleet file says."""
    seeds: Annotated[
        tuple[Annotated[int, between(0, 2**32 - 1, "a whole number")], ...],
        listed("at least one seed, each once", 1, unique=True),
    ] = (1,)
    """Each way to decide runs once with each seed."""
    run_on: Annotated[str, one_of(*RUN_ON)] = "virtual"
    rtf: Annotated[float, between(0.1, 20, "simulated time per real time")] = 3.0
    """With `run_on: simulator`: the requested real-time factor."""
    faults: tuple[Fault, ...] = ()
    loss: Annotated[float, between(0, MOST_LOSS, "a share of the messages")] = 0.0
    """Share of the messages between two processes that are lost."""
    time_limit: Annotated[float, positive("a number of seconds", 86400)] = 3600.0
    """A run ends then, on the hive's clock [s]."""

    def __attrs_post_init__(self) -> None:
        if (self.scenario is None) is (self.load is None):
            raise NotAllowedError((), "give either scenario or load")
        if self.load is not None and self.world is None:
            raise NotAllowedError(("world",), "missing; a load needs the name or path of a world")


@attrs.frozen
class Variant:
    """A way to decide.

    Attributes:
        architecture: A name of `ARCHITECTURES`.
        decision: Of the hive; empty for the others, which decide in their own ways.
        cost_model: Of the robots.
    """

    architecture: str
    decision: str
    cost_model: str

    @property
    def label(self) -> str:
        """Its name in tables."""
        return f"{self.decision or ARCHITECTURES[self.architecture]}, {self.cost_model}"

    @property
    def file_name(self) -> str:
        """Its name in the names of files."""
        return f"{self.decision or self.architecture}-{self.cost_model}"


@attrs.frozen(kw_only=True)
class Experiment(_Content):
    """An experiment that was read and checked; names of files are absolute or known."""

    path: Path

    @property
    def name(self) -> str:
        """The file's name without its ending."""
        return self.path.stem

    @property
    def variants(self) -> tuple[Variant, ...]:
        """The ways to decide, in the order of the file."""
        fleet = read_fleet(self.fleet)
        decisions = self.decisions or (fleet.decision,)
        built = [
            (architecture, decision)
            for architecture in self.architectures or (HIVE,)
            for decision in (decisions if architecture == HIVE else ("",))
        ]
        models = self.cost_models or (fleet.cost_model,)
        return tuple(Variant(*way, model) for way, model in itertools.product(built, models))

    @property
    def runs(self) -> tuple[tuple[Variant, int], ...]:
        """Every run: the variants take turns, seed by seed."""
        return tuple((variant, seed) for seed in self.seeds for variant in self.variants)

    def fleet_of(self, variant: Variant) -> Fleet:
        """Return the fleet as it decides in a variant."""
        fleet = read_fleet(self.fleet)
        decision = variant.decision or fleet.decision
        return attrs.evolve(fleet, decision=decision, cost_model=variant.cost_model)

    def scenario_of(self, seed: int) -> Scenario:
        """Return what is posted in the runs with a seed."""
        if self.scenario is not None:
            read = read_scenario(self.scenario)
            world = self.world or read.world
            chart = self.map or (read.map if self.world is None else world)
            limit = min(self.time_limit, read.time_limit)
            return attrs.evolve(read, world=world, map=chart, fleet=self.fleet, time_limit=limit)
        assert self.load is not None  # noqa: S101  (checked when it was read)
        assert self.world is not None  # noqa: S101  (checked when it was read)
        chart = self.map or self.world
        tasks = self.load.draw(load_map(chart), seed, places_of(self.world).values())
        return self.load.scenario(
            world=self.world, chart=chart, fleet=self.fleet, tasks=tasks, limit=self.time_limit
        )


def read_experiment(name: str) -> Experiment:
    """Read and check an experiment, given by its name in `experiments/` or by its path.

    Raises:
        hive_common.errors.FileError: There is no such experiment, or its file, or one that it
            names, has a mistake.
    """
    path = find_file("fleet_manager", "experiments", name)
    content = read_checked(path, _Content)
    given = attrs.asdict(content, recurse=False)
    for key in ("fleet", "scenario", "world", "map"):
        if given[key] is not None:
            given[key] = beside(path, given[key])
    experiment = Experiment(path=path, **given)
    with named_at(path, "fleet"):
        fleet = read_fleet(experiment.fleet)
    with named_at(path, "load" if experiment.scenario is None else "scenario"):
        experiment.scenario_of(experiment.seeds[0])
    _check_faults(experiment, fleet)
    _check_where(experiment, fleet)
    return experiment


def _check_faults(experiment: Experiment, fleet: Fleet) -> None:
    """Refuse faults of processes that there are not."""
    known = [*(robot.name for robot in fleet.robots), BLACKBOARD]
    for number, fault in enumerate(experiment.faults):
        if fault.process not in known:
            key = "kill" if fault.kill else "freeze"
            problem = f"'{fault.process}' is not in the fleet; allowed: {', '.join(known)}"
            raise error_at(experiment.path, ("faults", number, key), problem)


def _check_where(experiment: Experiment, fleet: Fleet) -> None:
    """Refuse what the place where the experiment runs does not have."""
    path = experiment.path
    if experiment.run_on == "virtual":
        agvs = [robot.name for robot in fleet.robots if robot.is_agv]
        if agvs:
            problem = (
                f"{', '.join(agvs)} speak VDA 5050, which needs a broker; set `run_on: simulator`"
            )
            raise error_at(path, ("fleet",), problem)
        return
    for number, architecture in enumerate(experiment.architectures):
        if architecture != HIVE:
            problem = f"'{architecture}' runs on virtual time only; set `run_on: virtual`"
            raise error_at(path, ("architectures", number), problem)
    if experiment.loss:
        problem = f"{experiment.loss:g}: messages are lost on virtual time only; leave it out, or "
        raise error_at(path, ("loss",), problem + "set `run_on: virtual`")
