# SPDX-License-Identifier: BSD-3-Clause
"""Measures how long a hive takes to start: until a task is accepted, and until all robots are up.

The ROS master runs already, as it does where `roslaunch` is typed a second time.
"""

from __future__ import annotations

import contextlib
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.client.client import HiveClient
from fleet_manager.config.fleet_file import read_fleet
from fleet_manager.demo.local_hive import local_hive, wait_for_everyone
from fleet_manager.errors import StartError
from hive_common.pose import Pose
from hive_lab.bench.registry import BenchResult, run_apart
from hive_lab.bench.usage import usage_of
from hive_lab.fleets.hall_files import HallFiles, write_hall

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from contextlib import AbstractContextManager

    from fleet_manager.client.client import ClientLink
    from fleet_manager.demo.local_hive import LocalHive

    Connect = Callable[[Sequence[str]], AbstractContextManager[ClientLink]]

_WORLD = "lab"
_MANY = 50
_REPEAT = 0.1  # time between two posts of the first task [s]
_WITHIN = 300.0  # a hive that takes longer has not started [s]
_GOAL = Pose(6.0, 4.0)
AIMS = {"first_task": 6.0, f"up_{_MANY}": 40.0}


def run(connect: Connect) -> BenchResult:
    """Start the default fleet, then fifty robots in a hall.

    Returns:
        From `roslaunch`, on the wall clock [s]: `first_task`, until four robots' hive has accepted
        a task, and `up_4` and `up_50`, until the blackboard has heard all robots. `cpu_4` and
        `cpu_50`: processor time used by then [s].
    """
    click.echo("starting 4 robots", err=True)
    figures = run_apart(_started, connect, HallFiles(_WORLD, _WORLD, _WORLD))
    click.echo(f"starting {_MANY} robots", err=True)
    with tempfile.TemporaryDirectory(prefix="robo-hive-bench-") as folder:
        many = run_apart(_started, connect, write_hall(Path(folder), _MANY))
    figures |= {name: value for name, value in many.items() if name != "first_task"}
    return BenchResult({name: round(value, 2) for name, value in figures.items()}, AIMS)


def _started(connect: Connect, files: HallFiles) -> dict[str, float]:
    names = [robot.name for robot in read_fleet(files.fleet).robots]
    with _hive() as hive, connect(()) as link:
        client = HiveClient(link)
        begun = link.now()
        hive.launch({**files._asdict(), "rviz": "false", "gui": "false"})
        accepted = _first_task(client, hive) - begun
        wait_for_everyone(client, names, hive, _WITHIN)
        return {
            "first_task": accepted,
            f"up_{len(names)}": link.now() - begun,
            f"cpu_{len(names)}": sum(
                each.cpu for each in usage_of(hive.processes.members()).values()
            ),
        }


@contextlib.contextmanager
def _hive() -> Iterator[LocalHive]:
    with (
        tempfile.TemporaryDirectory(prefix="robo-hive-bench-") as folder,
        local_hive(Path(folder)) as hive,
    ):
        hive.start_master()
        yield hive


def _first_task(client: HiveClient, hive: LocalHive) -> float:
    """Post a task until it is accepted; return when it was [s]."""
    task, link = Task("first", TaskType.GA, (_GOAL,)), client.link
    end = link.now() + _WITHIN

    def accepted() -> bool:
        return client.state.state_of(task.id) not in {None, TaskState.REJECTED}

    while not accepted():
        if link.now() > end:
            raise StartError(f"no task was accepted within {_WITHIN:g} s")
        link.post(replace(task, posted=link.hive_time()))
        client.pump(accepted, _REPEAT)
        hive.check()
    return link.now()
