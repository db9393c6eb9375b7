# SPDX-License-Identifier: BSD-3-Clause
"""The benchmark `traffic`: which of its parts is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from hive_lab.bench.kept_runs import KeptRuns
from hive_lab.bench.traffic.adversarial import in_layouts
from hive_lab.bench.traffic.fleets import chosen, of_fleets, with_faults
from hive_lab.bench.traffic.grids import on_grids
from hive_lab.bench.traffic.through_ros import through_ros
from hive_lab.fleets.throughput import Trouble

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from contextlib import AbstractContextManager
    from pathlib import Path

    from fleet_manager.client.client import ClientLink
    from hive_lab.bench.registry import BenchResult

MINUTES = 10  # simulated


def run(
    connect: Callable[[Sequence[str]], AbstractContextManager[ClientLink]],
    map: Path | None = None,  # noqa: A002  (the name of the option)
    scen: Sequence[Path] = (),
    faults: int = 0,
    site: str | None = None,
    robots: int | None = None,
    minutes: int = MINUTES,
    runs: int = 1,
    local: bool = False,
    people: int = 0,
    close: bool = False,
    delays: bool = False,
    ros: bool = False,
    adversarial: int = 0,
    resume: Path | None = None,
) -> BenchResult:
    """Measure the planner alone on files, runs with faults, a hive on ROS, or simulated fleets.

    Fleets drive in halls, or in small layouts that are hard for traffic.

    Args:
        connect: Opens the link to a hive.
        map: A movingai map.
        scen: What to plan on it: scenarios, `.scen`, or places of pickup and delivery, `.pd`.
        faults: How many runs with faults to simulate.
        site: Where fleets drive; everywhere by default.
        robots: How large a fleet.
        minutes: How long each fleet drives, simulated.
        runs: How many seeds each fleet drives with.
        local: Whether fleets go by the right of way alone.
        people: How many people walk about among each fleet.
        close: Whether a lane of each site closes for the middle third of the time.
        delays: Whether robots stop at random.
        ros: Whether a hive on ROS drives, with the traffic planner and without.
        adversarial: In how many small hard layouts a fleet drives.
        resume: Where the result of each run is kept, so that a long measurement can go on.

    Returns:
        Of a scenario, by robots: 1 if it is `unsolved`, `cost` over that of the shortest paths,
        seconds and processor time [s]. Of pickup and delivery, by tasks a step and robots:
        `makespan` and `service time` [steps], processor time of a plan [ms]. Of a fleet: goals per
        hour and robot, the share that it `loses` of its throughput, contacts, goals given up, the
        longest stand of a robot with a goal [s], the locks that the traffic planner has found,
        processor time of a plan [ms] and for a simulated second [s]; with delays, what it loses
        by them. Of faults: contacts, the first seed with one (-1 if none), the longest stand [s].
        Of layouts: those `unsolved`, in which a robot did not get to its goal within 300 s, the
        first seed that failed (-1 if none), contacts, the longest stands and run [s], the locks
        that the traffic planner has found. Of a hive on ROS: see `through_ros`.

    Raises:
        click.UsageError: Options do not go together.
        FileError: A file cannot be read, or holds something that is not allowed.
    """
    if (map is None) != (not scen):
        raise click.UsageError("--map and --scen need each other")
    if close and local:
        raise click.UsageError("--close needs the traffic planner: leave out --local")
    if map is not None:
        return on_grids(map, scen)
    if ros:
        return through_ros(connect, minutes)
    kept = KeptRuns(resume)
    if adversarial:
        return in_layouts(adversarial, kept)
    if faults:
        return with_faults(faults, kept)
    fleets, trouble = chosen(site, robots), Trouble(people, close, delays)
    return of_fleets(fleets, 60.0 * minutes, runs, trouble, kept, planned=not local)
