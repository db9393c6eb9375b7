# SPDX-License-Identifier: BSD-3-Clause
"""The charge of a drive by docs/cost-model.md, computed independently."""

import itertools
import math

import rospy

GRAVITY = 9.80665
POINTS = (
    *((0.0, 0.0), (0.05, 0.30), (0.10, 0.42), (0.20, 0.52)),
    *((0.50, 0.65), (0.80, 0.80), (0.95, 0.93), (1.0, 1.0)),
)
"""The page's table: charge, and the remaining share of the voltage range."""


def expected_charge(robot, load, before, after, track):
    """Return the charge [Ah] that a drive with a load takes, by the formulas of the page.

    Args:
        robot: Its name; its figures are on the parameter server.
        load: What it has on board [kg].
        before: Its status before.
        after: Its status afterwards.
        track: Where it was: stamp [s], x, y [m].
    """
    figures = rospy.get_param(f"/{robot}/characteristics")
    start, end = before.header.stamp.to_sec(), after.header.stamp.to_sec()
    places = [(x, y) for stamp, x, y in track if start <= stamp <= end]
    way = sum(itertools.starmap(math.dist, itertools.pairwise(places)))
    base = figures["base"]
    friction = base["friction_coefficient"] * (base["mass"] + load) * GRAVITY * way
    idle = figures["battery"]["idle_power"] * (end - start)
    return (friction + idle) / (3600.0 * volts(figures["battery"], before.charge))


def volts(battery, charge):
    """Return the voltage [V] at a charge from 0 to 1."""
    (low, below), (high, above) = next(
        pair for pair in itertools.pairwise(POINTS) if charge <= pair[1][0]
    )
    share = below + (above - below) * (charge - low) / (high - low)
    empty, full = battery["voltage_empty"], battery["voltage_full"]
    return empty + share * (full - empty)
