# SPDX-License-Identifier: BSD-3-Clause
"""The commands about planned traffic: `traffic`, `zone`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

from fleet_manager.cli.context import ZONE_NAME, pass_context
from fleet_manager.client import tables
from fleet_manager.client.client import HiveClient
from fleet_manager.client.traffic import lock_lines, traffic_data

if TYPE_CHECKING:
    from fleet_manager.cli.context import CliContext
    from fleet_manager.client.traffic import TrafficState

_zone_name = click.argument("name", metavar="NAME", type=ZONE_NAME)


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of tables.")
@pass_context
def traffic(context: CliContext, as_json: bool) -> None:
    """Show who waits for whom, closed zones, the slowest places, and who cannot go on.

    Coordinates are in m in the map frame; the slowest places are those of the last ten minutes.
    Robots cannot go on if they wait in a circle, or make no progress.

    \b
    Examples:
      hive traffic
      hive traffic --json | jq '.waits[] | select(.for > 30)'

    While the traffic planner is being loaded or started again, it says how far that is. Exits
    with 3 where nothing is heard of one: the fleet has none, or no member leads.
    """  # noqa: D301  (to click, \b means: keep the lines)
    with context.connect(()) as link:
        state = HiveClient(link).fetch_traffic()
    if as_json:
        click.echo(json.dumps(traffic_data(state), indent=2))
    else:
        click.echo("\n".join(_tables(state)))


@click.group()
def zone() -> None:
    """Close a zone, so that robots drive around it, or open it again.

    The fleet file names the zones. A zone stays closed through a takeover, until the hive ends.

    \b
    Examples:
      hive zone close door
      hive zone open door
    """  # noqa: D301  (to click, \b means: keep the lines)


@zone.command("close")
@_zone_name
@pass_context
def close(context: CliContext, name: str) -> None:
    """Close the zone NAME; robots that are inside leave it."""
    _switch(context, name, closed=True)


@zone.command("open")
@_zone_name
@pass_context
def open_(context: CliContext, name: str) -> None:
    """Open the zone NAME."""
    _switch(context, name, closed=False)


def _switch(context: CliContext, name: str, *, closed: bool) -> None:
    with context.connect(()) as link:
        HiveClient(link).switch_zone(name, closed=closed)
    click.echo(f"zone {name} is {'closed' if closed else 'open'}", err=True)


def _tables(state: TrafficState) -> list[str]:
    """Return what a person reads; what there is none of is said in a line."""
    if state.status:
        lines = [
            "the fleet's traffic is planned, but not now; robots drive by right of way",
            f"the traffic planner: {state.status}",
        ]
    else:
        lines = tables.waits_table(state) if state.waits else ["no robot waits for another one"]
    if state.zones:
        lines += ["", f"closed zones: {', '.join(state.closed) or 'none'}"]
    if state.slowest:
        lines += ["", *tables.slow_places_table(state)]
    locks = lock_lines(state)
    return [*lines, "", *locks] if locks else lines
