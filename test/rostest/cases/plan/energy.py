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


PACE = 0.6
"""A drive without turns, starts and other robots takes this share of the time at top speed."""


def expected_charges(robot, load, before, after, track):
    """Return the charge [Ah] that a drive with a load takes, by the formulas of the page.

    The idle power is drawn once per `status_period`, and each time the battery speaks. A machine
    that is held up leaves some of these out, so they are counted, and not the time that passed.

    Args:
        robot: Its name; its figures are on the parameter server.
        load: What it has on board [kg].
        before: What its battery said before.
        after: What its battery said afterwards.
        track: Where it was: stamp [s], x, y [m].

    Returns:
        For what the robot did, and for a drive of the same length at the rule-of-thumb pace.
    """
    figures = rospy.get_param(f"/{robot}/characteristics")
    start, end = before.header.stamp.to_sec(), after.header.stamp.to_sec()
    places = [(x, y) for stamp, x, y in track if start <= stamp <= end]
    way = sum(itertools.starmap(math.dist, itertools.pairwise(places)))
    base, battery = figures["base"], figures["battery"]
    friction = base["friction_coefficient"] * (base["mass"] + load) * GRAVITY * way
    draws = after.header.seq - before.header.seq
    times = (
        draws * rospy.get_param(f"/{robot}/robot/status_period"),
        way / (PACE * base["max_speed"]),
    )
    joule_per_ah = 3600.0 * volts(battery, before.percentage)
    return tuple((friction + battery["idle_power"] * time) / joule_per_ah for time in times)


def volts(battery, charge):
    """Return the voltage [V] at a charge from 0 to 1."""
    (low, below), (high, above) = next(
        pair for pair in itertools.pairwise(POINTS) if charge <= pair[1][0]
    )
    share = below + (above - below) * (charge - low) / (high - low)
    empty, full = battery["voltage_empty"], battery["voltage_full"]
    return empty + share * (full - empty)
