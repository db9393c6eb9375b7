# SPDX-License-Identifier: BSD-3-Clause
"""What is in the way of robots with a traffic planner: boxes, strangers, driven robots; no ROS."""

from __future__ import annotations

import math
from functools import cache

import pytest

pytest.importorskip("ompl")

from hive_lab.fleets.coordination import CoordinatorMaker
from hive_lab.fleets.sites import lab
from hive_lab.fleets.traffic import STEP, Traffic
from hive_navigation.control.obstacle_check import REMEMBERED
from hive_navigation.traffic.right_of_way import Announcement, no_right
from robot_description.models import load_model
from simenv.simulation import Simulation

SITE = lab()
WEST, EAST = (7.0, 3.2, 0.0), (13.5, 3.2, 0.0)
DOOR = (10.0, 3.2)  # between them; the lab has another door farther off
WIDE = 1.4  # how near to its middle a robot comes that looks into it [m]
WITHIN = 90.0  # [s]
QUEUE = 4.0  # a robot that waits for a station is this near [m]


@cache
def maker():
    """Return what makes traffic planners for the lab."""
    return CoordinatorMaker(SITE, ("ld60", "fetch"))


class Lab:
    """The lab with a traffic planner, and what is in the way."""

    def __init__(self, **robots):
        self.simulation = Simulation(SITE.world, seed=1)
        self.coordinator = maker().coordinator()
        self.traffic = Traffic(self.simulation, SITE.grid, self.coordinator)
        for name, pose in robots.items():
            self.traffic.add(name, load_model("ld60"), pose)

    def put(self, name, pose):
        """Put something that no robot knows; the laser sees it."""
        self.simulation.add_robot(name, load_model("fetch"), pose)

    def drive(self, name, goal, every_step=lambda: None):
        """Send a robot; return where it was on its way, and whether it got there."""
        self.traffic.send(name, goal)
        end, track = self.simulation.time + WITHIN, []
        while name not in self.traffic.outcomes and self.simulation.time < end:
            every_step()
            self.traffic.step()
            track.append(self.simulation.poses[name][:2])
        return track, name in self.traffic.outcomes and self.traffic.outcomes[name].reached

    def wait(self, seconds, every_step=lambda: None):
        """Let a time pass [s]."""
        for _ in range(round(seconds / STEP)):
            every_step()
            self.traffic.step()


def through_the_door(track):
    """Return whether a robot has been in the middle of the door."""
    return any(math.dist(place, DOOR) < 0.3 for place in track)


def says_where_it_is(lab, name):
    """Have all hear from a robot that is no robot of the fleet's, and follows no route."""
    x, y, _ = lab.simulation.poses[name]
    now, right = lab.simulation.time, no_right(name)
    lab.traffic.announce(
        Announcement(name, now, x, y, 0.4, right, ((x, y),), claim=0.0, stationary=False)
    )


def test_without_anything_in_the_way_robots_take_the_near_door():
    track, arrived = Lab(a=WEST).drive("a", EAST)

    assert arrived
    assert through_the_door(track)


def test_a_box_that_one_robot_has_seen_is_driven_around_by_all():
    lab = Lab(a=WEST, b=(2.6, 4.0, 0.0))
    lab.put("box", (*DOOR, math.pi / 2))
    lab.traffic.send("a", EAST)
    lab.wait(15.0)

    track, b_arrived = lab.drive("b", (12.0, 3.0, 0.0))
    lab.wait(10.0)

    assert b_arrived
    assert lab.traffic.outcomes["a"].reached
    assert min(math.dist(place, DOOR) for place in track) > WIDE  # it did not have to look
    assert lab.simulation.collisions == 0


def test_a_box_that_is_gone_is_forgotten_and_the_way_taken_again():
    lab = Lab(a=WEST)
    lab.put("box", (*DOOR, math.pi / 2))
    lab.drive("a", EAST)
    lab.simulation.remove_robot("box")
    lab.wait(REMEMBERED)

    track, arrived = lab.drive("a", WEST)

    assert arrived
    assert through_the_door(track)


def test_a_stranger_that_only_says_where_it_stands_is_planned_around():
    lab = Lab(a=WEST)
    lab.put("stranger", (*DOOR, math.pi / 2))

    def each_step():
        says_where_it_is(lab, "stranger")

    lab.wait(5.0, each_step)
    track, arrived = lab.drive("a", EAST, each_step)

    assert arrived
    assert min(math.dist(place, DOOR) for place in track) > WIDE  # it did not have to look
    assert lab.simulation.collisions == 0


def test_nobody_touches_a_robot_that_a_person_drives_and_all_arrive():
    lab = Lab(a=WEST, b=(12.0, 9.0, 0.0))
    lab.put("driven", (8.5, 3.2, 0.0))

    def each_step():
        x, _, _ = lab.simulation.poses["driven"]
        lab.simulation.set_command("driven", 0.3 if x < 11.5 else 0.0)
        says_where_it_is(lab, "driven")

    lab.traffic.send("b", (2.6, 4.0, 0.0))
    _, arrived = lab.drive("a", EAST, each_step)
    lab.wait(20.0, each_step)

    assert arrived
    assert lab.traffic.outcomes["b"].reached
    assert lab.simulation.collisions == 0


def test_robots_queue_for_a_station_beside_the_way_and_come_in_when_it_is_free():
    station = (12.7, 10.5, math.pi / 2)
    lab = Lab(a=station, b=(12.0, 3.0, 0.0), c=(7.0, 3.2, 0.0))
    lab.traffic.navigators["a"].stationary = True
    lab.traffic.send("b", station)
    lab.wait(40.0)
    waits_at = lab.simulation.poses["b"][:2]

    _, passes = lab.drive("c", (16.9, 10.5, math.pi / 2))
    lab.traffic.navigators["a"].stationary = False
    lab.traffic.send("a", (2.6, 4.0, 0.0))
    lab.wait(60.0)

    assert math.dist(waits_at, station[:2]) < QUEUE
    assert passes
    assert lab.traffic.outcomes["b"].reached
    assert lab.simulation.collisions == 0
