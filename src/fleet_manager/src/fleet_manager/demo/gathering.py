# SPDX-License-Identifier: BSD-3-Clause
"""Waits until a hive that was launched is all there."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fleet_manager.errors import StartError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fleet_manager.client.client import HiveClient
    from fleet_manager.client.hive_view import HiveView
    from fleet_manager.demo.local_hive import LocalHive

START_WITHIN = 120.0
"""Time for every robot and the blackboard to be heard [s]; a quiet machine needs about
ten, a busy one with two cores half a minute."""


def wait_for_everyone(
    client: HiveClient, robots: Sequence[str], hive: LocalHive, within: float = START_WITHIN
) -> None:
    """Wait until the blackboard has been heard, and it has heard every robot.

    A task that is posted before may be split among the robots that are there already.

    Args:
        client: Listens to the hive.
        robots: Names of the robots.
        hive: Its processes, launched.
        within: How long at most [s].

    Raises:
        StartError: Some were not heard, which the text names, or a process has ended by itself.
    """
    end = client.link.now() + within
    while missing(client.view, robots):
        client.pump(lambda: not missing(client.view, robots), 0.5)
        hive.check()
        if client.link.now() > end:
            died = hive.why_missing()
            why = f" ({died})" if died else ""
            raise StartError(
                f"not heard within {within:g} s: {', '.join(missing(client.view, robots))}{why}; "
                f"the logs are in {hive.processes.folder}"
            )


def missing(view: HiveView, robots: Sequence[str]) -> list[str]:
    """Return who has not been heard yet, the blackboard first."""
    if view.heartbeat is None:
        return ["the blackboard", *(name for name in robots if name not in view.robots)]
    known = view.robots.keys() & view.heartbeat.heard.keys()
    return [name for name in robots if name not in known]
