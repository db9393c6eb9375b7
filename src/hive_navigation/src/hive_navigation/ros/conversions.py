# SPDX-License-Identifier: BSD-3-Clause
"""Converts what robots and traffic planner tell each other; only messages say `way` for path."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import rospy
from geometry_msgs.msg import Point as PointMsg
from geometry_msgs.msg import Point32
from robot_description.msg import Route as RouteMsg
from robot_description.msg import Routes, Traffic
from robot_description.msg import Wait as WaitMsg
from std_msgs.msg import Header

from hive_common.pose import FARTHEST
from hive_navigation.mapf.route import PlanNumber, Route, Wait
from hive_navigation.traffic.right_of_way import UNKNOWN_LIMITS, Announcement, Limits, Right

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hive_navigation.planning.path import Point

AHEAD = 1.0  # how far the clocks of robots may differ [s]
WIDEST = 10.0  # greatest radius of a robot [m]
HIGHEST_EPOCH = 2**31 - 1  # of a traffic planner; it is told to it as a parameter
LONGEST_WAY = 10_000.0  # greatest length of a path and of a claim [m]


def traffic_to_msg(announcement: Announcement, frame: str) -> Traffic:
    """Return an announcement as a message."""
    right, limits, goal = announcement.right, announcement.limits, announcement.goal
    return Traffic(
        header=Header(stamp=rospy.Time.from_sec(announcement.time), frame_id=frame),
        name=announcement.name,
        way=[Point32(x, y, 0.0) for x, y in announcement.path],
        radius=announcement.radius,
        claim=announcement.claim,
        parked=announcement.stationary,
        since=right.since,
        owner=right.owner,
        rank=right.step,
        yaw=announcement.yaw,
        has_goal=goal is not None,
        goal=_point(goal),
        max_speed=limits.speed,
        acceleration=limits.acceleration,
        yaw_rate=limits.yaw_rate,
        epoch=announcement.plan.epoch,
        number=announcement.plan.number,
        passed=announcement.passed,
        waits_for=announcement.waits_for,
        obstacles=[Point32(*each) for each in announcement.obstacles],
    )


def traffic_from_msg(msg: Traffic, now: float) -> Announcement:
    """Return the announcement in a message that came at a time [s].

    One that is dated ahead counts as of now: it must not count on after its robot has fallen
    silent.

    Raises:
        ValueError: Its numbers cannot be used.
    """
    path = tuple((point.x, point.y) for point in msg.way)
    obstacles = tuple((each.x, each.y, each.z) for each in msg.obstacles)
    length = sum(map(math.dist, path, path[1:]))
    if not (path and _usable(*path) and length <= LONGEST_WAY):
        raise ValueError(
            f"traffic of {msg.name[:40]!r} is ignored: it needs a way of points within "
            f"{FARTHEST / 1000:g} km of the origin, at most {LONGEST_WAY / 1000:g} km long"
        )
    if not (0 < msg.radius <= WIDEST and 0 <= msg.claim <= LONGEST_WAY):
        raise ValueError(
            f"traffic of {msg.name[:40]!r} is ignored: it needs a radius above 0 and at most "
            f"{WIDEST:g} m, and a claim from 0 to {LONGEST_WAY:g} m"
        )
    if not _usable(msg.yaw, (msg.goal.x, msg.goal.y), *obstacles):
        raise ValueError(
            f"traffic of {msg.name[:40]!r} is ignored: yaw, goal and obstacles need numbers of at "
            f"most {FARTHEST:g}"
        )
    return Announcement(
        name=msg.name,
        time=min(msg.header.stamp.to_sec(), now + AHEAD),
        x=path[0][0],
        y=path[0][1],
        radius=msg.radius,
        right=Right(msg.since, msg.owner, msg.rank, msg.name),
        path=path,
        claim=msg.claim,
        stationary=msg.parked,
        yaw=msg.yaw,
        goal=(msg.goal.x, msg.goal.y) if msg.has_goal else None,
        limits=_limits(msg),
        plan=PlanNumber(msg.epoch, msg.number),
        passed=msg.passed,
        waits_for=msg.waits_for,
        obstacles=obstacles,
    )


def _limits(msg: Traffic) -> Limits:
    """Return how fast a robot can be; `UNKNOWN_LIMITS` where it does not say."""
    given = Limits(msg.max_speed, msg.acceleration, msg.yaw_rate)
    if given == (0.0, 0.0, 0.0):
        return UNKNOWN_LIMITS
    if not (_usable(*given) and min(given) > 0):
        raise ValueError(
            f"traffic of {msg.name[:40]!r} is ignored: max_speed, acceleration and yaw_rate need "
            "numbers above 0, or 0 in all three"
        )
    return given


def routes_to_msg(plan: PlanNumber, routes: Iterable[Route], now: float, frame: str) -> Routes:
    """Return routes of a plan as a message, stamped with a time [s]."""
    return Routes(
        header=Header(stamp=rospy.Time.from_sec(now), frame_id=frame),
        epoch=plan.epoch,
        number=plan.number,
        routes=[
            RouteMsg(
                robot=route.robot,
                has_goal=route.goal is not None,
                goal=_point(route.goal),
                first=route.first,
                places=[Point32(x, y, 0.0) for x, y in route.places],
                waits=[WaitMsg(*wait) for wait in route.waits],
                complete=route.complete,
            )
            for route in routes
        ],
    )


def routes_from_msg(msg: Routes) -> tuple[PlanNumber, tuple[Route, ...]]:
    """Return a plan's number and its routes; raise ValueError if its numbers cannot be used."""
    plan = PlanNumber(msg.epoch, msg.number)
    if plan.epoch > HIGHEST_EPOCH:
        # Robots would obey no other planner any more.
        raise ValueError(
            f"routes of plan {plan.epoch}/{plan.number} are ignored: the epoch is above "
            f"{HIGHEST_EPOCH}, which no planner has"
        )
    return plan, tuple(_route_from_msg(route, plan) for route in msg.routes)


def _route_from_msg(msg: RouteMsg, plan: PlanNumber) -> Route:
    places = tuple((place.x, place.y) for place in msg.places)
    if not _usable((msg.goal.x, msg.goal.y), *places):
        raise ValueError(
            f"routes of plan {plan.epoch}/{plan.number} are ignored: that of {msg.robot[:40]!r} "
            f"needs a goal and places within {FARTHEST / 1000:g} km of the origin"
        )
    return Route(
        robot=msg.robot,
        plan=plan,
        goal=(msg.goal.x, msg.goal.y) if msg.has_goal else None,
        first=msg.first,
        places=places,
        waits=tuple(Wait(wait.at, wait.robot, wait.passes) for wait in msg.waits),
        complete=msg.complete,
    )


def _point(point: Point | None) -> PointMsg:
    return PointMsg() if point is None else PointMsg(*point, 0.0)


def _usable(*values: float | tuple[float, ...]) -> bool:
    """Return whether all numbers are such as a site can have."""
    return all(
        abs(number) <= FARTHEST
        for value in values
        for number in (value if isinstance(value, tuple) else (value,))
    )
