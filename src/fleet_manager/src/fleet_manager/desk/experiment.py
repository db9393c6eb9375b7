# SPDX-License-Identifier: BSD-3-Clause
"""What the form of an experiment can show: the keys of an experiment file, and what is typed.

`hive compare` checks an experiment as a whole before it runs; here are the types and ranges that
the fields have. Names may be empty: what was typed half can be shown again.
"""

from pathlib import Path
from typing import Annotated

import attrs
import yaml

from blackboard.domain.settings import COST_MODEL_NAMES, DECISIONS
from fleet_manager.client.comparison import ARCHITECTURES, MOST_LOSS, RUN_ON
from fleet_manager.config.load import TYPES
from hive_common.errors import FileError
from hive_common.resources import find_file
from hive_common.structuring import NotAllowedError, between, listed, one_of

WEIGHT, LIMIT = 100.0, 86400.0
"""The largest weight of a task type, and time [s]."""
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # a large fleet takes the other one long

_Seconds = Annotated[float, between(0, LIMIT, "a number of seconds")]


@attrs.frozen(kw_only=True)
class ShownFault:
    """A fault as a row of fields."""

    after: _Seconds = 60.0
    """From the first posting [s]."""
    kill: str | None = None
    freeze: str | None = None
    """Whose process is killed or frozen; one of the two."""
    seconds: _Seconds = 5.0
    """How long a process is frozen [s]."""

    def __attrs_post_init__(self) -> None:
        if (self.kill is None) is (self.freeze is None):
            raise NotAllowedError((), "give either kill or freeze")


@attrs.frozen(kw_only=True)
class ShownLoad:
    """The load generator's fields."""

    at_once: Annotated[int, between(0, 1000, "a number of tasks")] = 0
    per_hour: Annotated[float, between(0, 3600, "a number of tasks")] = 0.0
    minutes: Annotated[float, between(0, 1440, "a number of minutes")] = 10.0
    mix: dict[Annotated[str, one_of(*TYPES)], Annotated[float, between(0, WEIGHT, "a weight")]] = (
        attrs.field(factory=lambda: dict.fromkeys(TYPES, 1.0))
    )


@attrs.frozen(kw_only=True)
class ShownExperiment:
    """The content of an experiment file; what it leaves out has its default."""

    description: str = ""
    fleet: str
    scenario: str | None = None
    load: ShownLoad | None = None
    world: str = "lab"
    map: str = ""
    architectures: Annotated[
        tuple[Annotated[str, one_of(*ARCHITECTURES)], ...], listed("architectures")
    ] = ()
    decisions: Annotated[tuple[Annotated[str, one_of(*DECISIONS)], ...], listed("decisions")] = ()
    cost_models: Annotated[
        tuple[Annotated[str, one_of(*COST_MODEL_NAMES)], ...], listed("cost models")
    ] = ()
    seeds: Annotated[
        tuple[Annotated[int, between(0, 2**32 - 1, "a whole number")], ...],
        listed("at least one seed", 1),
    ] = (1,)
    run_on: Annotated[str, one_of(*RUN_ON)] = "virtual"
    rtf: Annotated[float, between(0.1, 20, "simulated time per real time")] = 3.0
    faults: tuple[ShownFault, ...] = ()
    loss: Annotated[float, between(0, MOST_LOSS, "a share of the messages")] = 0.0
    time_limit: Annotated[float, between(0.1, LIMIT, "a number of seconds")] = 3600.0


@attrs.frozen(kw_only=True)
class TypedExperiment(ShownExperiment):
    """Everything that was typed, whether it counts or not, and right or wrong."""

    by_load: bool | None = None
    """Whether the load generator is chosen; None: where there is a load."""
    seeds_text: str | None = None
    """The field of the seeds; None: as `seeds`."""


def robot_names(fleet: str) -> list[str]:
    """Return the names of the robots in a fleet file, by its name or path; none without one."""
    try:
        path = find_file("fleet_manager", "fleets", fleet)
        if not Path(path).is_file():  # a pipe would be read for ever
            return []
        content = yaml.load(path.read_text(encoding="utf-8"), Loader=_LOADER)  # noqa: S506  (safe)
        names = [robot["name"] for robot in content["robots"]]
    except (FileError, OSError, ValueError, yaml.YAMLError, TypeError, KeyError, RuntimeError):
        return []
    return [name for name in names if isinstance(name, str)]
