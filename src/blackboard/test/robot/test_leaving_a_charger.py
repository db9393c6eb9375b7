# SPDX-License-Identifier: BSD-3-Clause
"""Where a robot goes from its charger, and when it leaves it to one that waits."""

import math

import pytest

from blackboard.consensus.journal import MemoryJournal
from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.domain.settings import ChargingSettings
from blackboard.errors import JournalError
from blackboard.robot.charging import ChargingPlan
from blackboard.robot.executor import CommandResult, CommandState
from hive_common.pose import Pose
from hive_lab.virtual.hive import Hive

HERE, A = Pose(0.0, 0.0), Pose(10.0, 0.0)
EAST, WEST = Pose(5.0, 5.0), Pose(-5.0, 5.0)
ONE = ChargingPlan({"charger 1": EAST})
TWO = ChargingPlan({"charger 1": EAST, "charger 2": WEST})
HOUR = 3600.0


def goals(hive, robot="robot1"):
    return [step.goal for step in hive.commands[robot].started]


def test_a_robot_that_restarts_where_it_charges_goes_back_to_where_it_started():
    journal, hive = MemoryJournal(), Hive()
    hive.add_robot("robot1", HERE, charge=0.25, charging=ONE, journal=journal)
    hive.network.run(20.0)
    hive.add_robot("robot1", EAST, charge=0.5, charging=ONE, journal=journal)
    hive.network.run(HOUR)

    assert goals(hive) == [HERE]


def test_a_robot_that_starts_at_a_charger_and_knows_no_other_place_stays_there():
    hive = Hive()
    hive.add_robot("robot1", EAST, charge=0.5, charging=ONE)
    hive.network.run(HOUR)

    assert goals(hive) == []


def with_one_that_waits(plan, results=(), path_lengths=None):
    """Return a hive in which robot1, home at a charger, has been asked to leave it for a while."""
    hive = Hive()
    hive.add_robot("robot1", EAST, charging=plan, path_lengths=path_lengths)
    hive.commands["robot1"].results = list(results)
    hive.add_robot("robot2", HERE, charge=0.1, charging=ONE)
    hive.network.run(60.0)
    return hive


def test_a_robot_that_started_at_a_charger_leaves_it_to_one_that_waits():
    hive = with_one_that_waits(ONE)

    (aside,) = goals(hive)
    assert aside.distance_to(EAST) == pytest.approx(3.0)
    assert goals(hive, "robot2") == [EAST]


def test_a_robot_leaves_its_charger_to_one_that_waits_once_it_has_enough():
    hive = Hive()
    hive.add_robot("robot1", HERE, charge=0.25, charging=ONE)
    hive.network.run(20.0)
    hive.add_robot("robot2", HERE, charge=0.1, charging=ONE)
    hive.network.run_until(lambda: goals(hive, "robot2"), limit=HOUR)

    assert goals(hive) == [EAST, HERE]
    charge = hive.robots["robot1"].status.charge
    assert charge == pytest.approx(ChargingSettings().enough, abs=0.02)


def test_only_the_robot_that_has_charged_most_leaves_its_charger_to_one_that_waits():
    hive = Hive()
    for name, pose, charge in (("robot1", EAST, 0.8), ("robot2", WEST, 0.9), ("low", HERE, 0.1)):
        hive.add_robot(name, pose, charge=charge, charging=TWO)
    hive.network.run(60.0)

    assert goals(hive) == []
    assert goals(hive, "low") == [WEST]


@pytest.mark.parametrize("apart", [1.0, 2.0, 3.0, 4.0])
def test_a_robot_that_makes_room_stays_away_from_all_chargers(apart):
    row = {f"row {k}": Pose(EAST.x, EAST.y + apart * k) for k in (-3, -2, -1, 1, 2, 3)}
    (aside,) = goals(with_one_that_waits(ChargingPlan(ONE.chargers | row)))

    assert min(aside.distance_to(each) for each in (EAST, *row.values())) > 1.5


def test_a_robot_that_cannot_make_room_at_one_place_tries_another():
    lost = CommandResult(CommandState.ABORTED, "no way")
    hive = with_one_that_waits(ONE, results=[lost] * 3)

    first, *_, last = goals(hive)
    assert first != last
    assert goals(hive, "robot2") == [EAST]


def test_a_robot_that_can_go_nowhere_stays_at_its_charger():
    class Walled(EuclideanLengths):
        def length(self, start, goal):
            return 0.0 if start == goal else math.inf

    assert goals(with_one_that_waits(ONE, path_lengths=Walled())) == []


def test_a_robot_that_cannot_get_home_makes_room_elsewhere_if_another_waits():
    journal = MemoryJournal()
    journal.save_home(A)
    hive = Hive()
    hive.add_robot("robot1", EAST, charging=ONE, journal=journal)
    hive.commands["robot1"].results = [CommandResult(CommandState.ABORTED, "no way")] * 3
    hive.add_robot("robot2", HERE, charge=0.1, charging=ONE)
    hive.network.run(60.0)

    assert goals(hive)[0] == A
    assert goals(hive)[-1].distance_to(EAST) == pytest.approx(3.0)
    assert goals(hive, "robot2") == [EAST]


def test_a_robot_whose_disk_is_full_charges_and_says_what_it_may_forget():
    class FullDisk(MemoryJournal):
        def save_home(self, _):
            raise JournalError("no space left on device")

    hive = Hive()
    hive.add_robot("robot1", HERE, charge=0.25, charging=ONE, journal=FullDisk())
    hive.network.run(HOUR)

    assert goals(hive) == [EAST, HERE]
    assert "may forget where it comes from" in hive.talkers["robot1"].warnings[0]
