# SPDX-License-Identifier: BSD-3-Clause
"""What fails in simulated traffic fails as its schedule says."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("ompl")

from hive_lab.fleets.faulty_traffic import KINDS, OFF, TAKEOVER, Fault, FaultyTraffic, draw_faults
from hive_lab.fleets.sites import drawn_site
from hive_lab.fleets.traffic import STEP, Traffic
from hive_navigation.mapf.route import PlanNumber, Route
from robot_description.models import load_model
from simenv.simulation import Simulation

ROOM = drawn_site("room", (10.0, 8.0), [], room=0.6)
STARTS = {"a": (2.0, 2.0, 0.0), "b": (8.0, 2.0, math.pi), "c": (5.0, 6.0, 0.0)}


class FakeCoordinator:
    """Notes when it plans and whom it hears; its routes lead everybody to where it stands."""

    def __init__(self, epoch):
        self.epoch = epoch
        self.planned = []
        self.heard = {}

    def hear(self, said):
        self.heard.setdefault(said.name, []).append(said)

    def step(self, now):
        self.planned.append(now)
        plan = PlanNumber(self.epoch, len(self.planned))
        return tuple(
            Route(name, plan, None, 0, ((said[-1].x, said[-1].y),), (), complete=True)
            for name, said in self.heard.items()
        )


class FakeMaker:
    """Makes such coordinators and keeps them."""

    def __init__(self):
        self.made = []

    def coordinator(self, epoch):
        self.made.append(FakeCoordinator(epoch))
        return self.made[-1]


@pytest.fixture
def run():
    """Let three robots stand for a time while things fail; return their traffic and planners."""

    def ran(seconds, *faults):
        maker = FakeMaker()
        simulation = Simulation(ROOM.world, seed=1)
        traffic = FaultyTraffic(simulation, ROOM.grid, maker, faults, seed=1)
        for name, pose in STARTS.items():
            traffic.add(name, load_model("ld60"), pose)
        for _ in range(round(seconds / STEP)):
            traffic.step()
        return traffic, maker.made

    return ran


def heard(traffic, listener, speaker):
    """Return what a robot has heard last of another one."""
    return traffic._ears[listener].latest(speaker)  # noqa: SLF001  (what reached it)


def test_without_a_fault_robots_drive_as_in_traffic_that_cannot_fail():
    poses = []
    for make in (
        lambda simulation: Traffic(simulation, ROOM.grid),
        lambda simulation: FaultyTraffic(simulation, ROOM.grid, Silent(), (), seed=1),
    ):
        simulation = Simulation(ROOM.world, seed=1)
        traffic = make(simulation)
        for name, pose in STARTS.items():
            traffic.add(name, load_model("ld60"), pose)
        traffic.send("a", STARTS["b"])
        traffic.send("b", STARTS["a"])
        for _ in range(round(6.0 / STEP)):
            traffic.step()
        poses.append(simulation.poses)

    assert poses[0] == poses[1]
    assert math.dist(poses[0]["a"][:2], STARTS["a"][:2]) > 3.0


class Silent:
    """Makes coordinators that never plan."""

    def coordinator(self, epoch):
        silent = FakeCoordinator(epoch)
        silent.step = lambda _now: ()
        return silent


def test_two_seconds_after_a_planner_was_killed_one_of_the_next_epoch_plans(run):
    _, made = run(6.0, Fault("killed", 2.0, 3.0))

    assert [planner.epoch for planner in made] == [1, 2]
    assert max(made[0].planned) == pytest.approx(1.9)
    assert min(made[1].planned) == pytest.approx(2.0 + TAKEOVER)


def test_a_short_freeze_leads_to_no_takeover(run):
    _, made = run(6.0, Fault("frozen", 2.0, 3.0))

    assert [planner.epoch for planner in made] == [1]
    assert not [now for now in made[0].planned if 2.0 <= now < 3.0]
    assert [now for now in made[0].planned if now >= 3.0]
    assert len(made[0].heard["a"]) > 50


def test_after_a_long_freeze_the_old_planner_plans_once_beside_the_new_one(run):
    traffic, made = run(8.0, Fault("frozen", 2.0, 6.0))

    assert [planner.epoch for planner in made] == [1, 2]
    assert len([now for now in made[0].planned if now >= 6.0]) == 1
    assert min(made[1].planned) == pytest.approx(2.0 + TAKEOVER)
    assert all(navigator._keeper.plan.epoch == 2 for navigator in traffic.navigators.values())  # noqa: SLF001


def test_a_robot_that_is_cut_off_hears_robots_but_no_planner(run):
    traffic, made = run(2.0, Fault("cut off", 0.0, 9.0, frozenset("a")))

    assert set(made[0].heard) == {"b", "c"}
    assert heard(traffic, "b", "a").time > 1.5
    assert traffic.navigators["a"]._keeper.route is None  # noqa: SLF001
    assert traffic.navigators["b"]._keeper.route is not None  # noqa: SLF001


def test_messages_of_a_robot_get_lost_and_late(run):
    _, made = run(10.0, Fault("lossy", 0.0, 20.0, frozenset("a")))
    times = [said.time for said in made[0].heard["a"]]

    assert 50 < len(times) < 85 < len(made[0].heard["b"])
    assert times != sorted(times)


def test_a_robot_that_reports_a_wrong_position_is_heard_where_it_is_not(run):
    traffic, made = run(1.0, Fault("misplaced", 0.0, 9.0, frozenset("a"), angle=math.pi / 2))
    said = made[0].heard["a"][-1]

    assert (said.x, said.y) == pytest.approx((2.0, 2.0 + OFF), abs=0.01)
    assert said.path[0] == (said.x, said.y)
    assert heard(traffic, "b", "a").y == pytest.approx(2.0 + OFF, abs=0.01)


def test_faults_are_drawn_of_all_kinds_and_again_the_same():
    drawn = [fault for seed in range(20) for fault in draw_faults([*"abcd"], 60.0, seed)]

    assert {fault.kind for fault in drawn} == set(KINDS)
    assert all(fault.robots and 0.0 <= fault.begin < 60.0 for fault in drawn)
    assert draw_faults([*"abcd"], 60.0, 7) == draw_faults([*"abcd"], 60.0, 7)
