# SPDX-License-Identifier: BSD-3-Clause
import math
import re
from pathlib import Path

import pytest

from hive_common.pose import Pose
from robot_description.models import load_model
from simenv.bodies.pick import Act, Load, Order, PickOutcome
from simenv.errors import CommandError
from simenv.noise import NO_NOISE
from simenv.simulation import Simulation
from simenv.testing import hall
from simenv.world.world_content import Station

FETCH = load_model("fetch")
HERE = Pose(5.0, 5.0, 0.0)
PICK_TIME = FETCH.arm.pick_duration
PLACE_TIME = FETCH.arm.place_duration
STEP = 0.1  # [s]


def start(*stations, pose=HERE):
    simulation = Simulation(hall(stations=stations), noise=NO_NOISE)
    simulation.add_robot("robot1", FETCH, pose)
    return simulation, simulation.arm("robot1")


def wait(simulation, seconds, command=None):
    for _ in range(round(seconds / STEP)):
        if command:
            simulation.set_command("robot1", *command)
        simulation.step(STEP)


def do(simulation, act, task_id="T1", payload=2.0):
    arm = simulation.arm("robot1")
    arm.start(Order(act, task_id, payload), simulation.poses["robot1"])
    wait(simulation, 12.0)
    return arm.result


def test_a_pick_takes_as_long_as_the_arm_needs_and_loads_the_robot():
    simulation, arm = start()
    arm.start(Order(Act.PICK, "T1", 2.0), HERE)

    wait(simulation, PICK_TIME - STEP)
    assert arm.busy
    assert arm.payload == 0.0
    assert arm.progress == pytest.approx(1.0, abs=0.02)
    wait(simulation, STEP)

    assert arm.result.outcome is PickOutcome.SUCCESS
    assert arm.payload == 2.0
    assert not arm.busy


def test_progress_grows_evenly_from_0_to_1():
    simulation, arm = start()
    arm.start(Order(Act.PICK, "T1", 2.0), HERE)
    assert arm.progress == 0.0

    wait(simulation, PICK_TIME / 2)

    assert arm.progress == pytest.approx(0.5)


def test_what_was_picked_for_a_task_is_put_down_for_it():
    simulation, arm = start()
    do(simulation, Act.PICK, "T1", 2.0)

    put_down = do(simulation, Act.PLACE, "T1")

    assert put_down.outcome is PickOutcome.SUCCESS
    assert arm.load is None
    assert arm.payload == 0.0


def test_a_pick_for_another_task_takes_the_place_of_what_was_on_board():
    simulation, arm = start()
    do(simulation, Act.PICK, "T1", 2.0)

    do(simulation, Act.PICK, "T2", 1.0)

    assert arm.load == Load("T2", 1.0)


def test_putting_down_takes_the_time_of_putting_down():
    simulation, arm = start()
    do(simulation, Act.PICK)
    arm.start(Order(Act.PLACE, "T1", 2.0), HERE)

    wait(simulation, PLACE_TIME - STEP)
    assert arm.busy
    wait(simulation, STEP)

    assert arm.result.outcome is PickOutcome.SUCCESS


def test_a_load_makes_the_robot_slower_to_start():
    simulation, arm = start()
    arm.load = Load("T1", FETCH.base.mass)

    wait(simulation, 0.5, (1.0, 0.0, 0.0))

    assert simulation.velocity("robot1")[0] == pytest.approx(FETCH.base.acceleration * 0.5 / 2)


def test_a_load_over_what_the_arm_can_lift_is_refused_at_once():
    _, arm = start()
    arm.start(Order(Act.PICK, "T1", FETCH.arm.payload + 0.1), HERE)

    assert arm.result.outcome is PickOutcome.TOO_HEAVY
    assert "6.1 kg is over the arm's 6 kg" in arm.result.message
    assert not arm.busy


def test_nothing_can_be_put_down_that_is_not_on_board():
    simulation, _ = start()
    do(simulation, Act.PICK, "T1")

    put_down = do(simulation, Act.PLACE, "T2")

    assert put_down.outcome is PickOutcome.NOTHING_THERE
    assert put_down.message == "the load of task 'T1' is on board, not the load of task 'T2'"


@pytest.mark.parametrize("command", [(0.3, 0.0, 0.0), (0.0, 0.0, 0.3)])
def test_a_base_that_moves_ends_the_pick_and_nothing_is_loaded(command):
    simulation, arm = start()
    arm.start(Order(Act.PICK, "T1", 2.0), HERE)
    wait(simulation, 1.0)

    wait(simulation, 1.0, command)

    assert arm.result.outcome is PickOutcome.MOVED
    assert arm.payload == 0.0


def test_a_cancelled_pick_loads_nothing_and_the_arm_is_free_again():
    simulation, arm = start()
    arm.start(Order(Act.PICK, "T1", 2.0), HERE)
    wait(simulation, 1.0)

    arm.cancel()
    wait(simulation, 12.0)

    assert arm.result is None
    assert arm.payload == 0.0
    assert do(simulation, Act.PICK).outcome is PickOutcome.SUCCESS


def test_an_arm_at_work_takes_no_second_order():
    _, arm = start()
    arm.start(Order(Act.PICK, "T1", 2.0), HERE)

    with pytest.raises(CommandError, match="the arm is busy"):
        arm.start(Order(Act.PICK, "T2", 2.0), HERE)


def test_a_station_has_its_own_duration():
    simulation, arm = start(Station("shelf", Pose(5.2, 5.0, 0.0), duration=1.0))
    arm.start(Order(Act.PICK, "T1", 2.0), HERE)

    wait(simulation, 1.0)

    assert arm.result.message == "picked at 'shelf'"


def test_a_station_out_of_reach_does_not_count():
    simulation, _ = start(Station("shelf", Pose(7.0, 5.0, 0.0), stock=0))

    assert do(simulation, Act.PICK).message == "picked at a free place"


def test_a_station_runs_out_and_is_filled_by_what_is_put_down():
    simulation, _ = start(Station("shelf", HERE, stock=1))
    assert do(simulation, Act.PICK, "T1").outcome is PickOutcome.SUCCESS

    empty = do(simulation, Act.PICK, "T2")
    do(simulation, Act.PLACE, "T1")
    refilled = do(simulation, Act.PICK, "T2")
    empty_again = do(simulation, Act.PICK, "T3")

    assert empty.outcome is PickOutcome.NOTHING_THERE
    assert empty.message == "nothing is left at 'shelf'"
    assert refilled.outcome is PickOutcome.SUCCESS
    assert empty_again.outcome is PickOutcome.NOTHING_THERE


def test_a_robot_without_arm_cannot_pick():
    simulation = Simulation(hall())
    simulation.add_robot("robot1", load_model("mir100"), HERE)

    with pytest.raises(CommandError, match="mir100 has no arm"):
        simulation.arm("robot1").start(Order(Act.PICK, "T1", 0.0), HERE)


@pytest.mark.parametrize("payload", [-1.0, math.nan, math.inf])
def test_a_load_that_is_no_load_is_refused(payload):
    with pytest.raises(CommandError, match="at least 0"):
        Order(Act.PICK, "T1", payload)


def test_the_numbers_are_those_of_the_action():
    action = Path(__file__).parents[3] / "blackboard/action/Pick.action"
    numbers = dict(re.findall(r"^uint8 ([A-Z_]+) = (\d+)", action.read_text(), re.MULTILINE))

    assert {member.name: member.value for enum in (Act, PickOutcome) for member in enum} == {
        name: int(number) for name, number in numbers.items()
    }


def test_an_order_that_was_done_succeeds_again_without_a_move():
    simulation, arm = start()
    order = Order(Act.PICK, "T1", 2.0, action_id="hive1/T1/1/1")
    arm.start(order, HERE)
    wait(simulation, PICK_TIME)
    put_down = Order(Act.PLACE, "T1", 2.0, action_id="hive1/T1/1/3")
    arm.start(put_down, HERE)
    wait(simulation, PLACE_TIME)

    for again in (order, put_down):
        arm.start(again, HERE)

        assert not arm.busy
        assert arm.result.outcome is PickOutcome.SUCCESS
        assert arm.load is None


def test_an_order_without_an_id_is_done_each_time():
    _, arm = start()
    arm.start(Order(Act.PICK, "T1", 2.0), HERE)

    assert not arm.is_at(Order(Act.PICK, "T1", 2.0))


def test_an_order_whose_grip_failed_is_tried_again_under_the_same_id():
    simulation, arm = start()
    order = Order(Act.PICK, "T1", 2.0, action_id="hive1/T1/1/1")
    arm.fail_next = 1
    arm.start(order, HERE)
    wait(simulation, PICK_TIME)

    arm.start(order, HERE)

    assert arm.is_at(order)


@pytest.mark.parametrize(
    ("task_id", "posted", "outcome"),
    [
        ("T1", 7.0, PickOutcome.SUCCESS),
        ("T1", 7.0004, PickOutcome.SUCCESS),
        ("T1", 0.0, PickOutcome.SUCCESS),
        ("T1", 9.0, PickOutcome.HOLDS_ANOTHER),
        ("T2", 7.0, PickOutcome.HOLDS_ANOTHER),
    ],
)
def test_an_arm_that_is_to_look_first_picks_nothing_while_a_load_is_on_board(
    task_id, posted, outcome
):
    simulation, arm = start()
    arm.start(Order(Act.PICK, "T1", 2.0, posted=7.0), HERE)
    wait(simulation, PICK_TIME)

    again = Order(Act.PICK, task_id, 1.0, action_id="hive2/T/1/1", look=True, posted=posted)
    arm.start(again, HERE)

    assert arm.result.outcome is outcome
    assert arm.load == Load("T1", 2.0, 7.0)


def test_the_load_of_an_earlier_task_is_not_put_down_for_a_later_one_with_its_id():
    simulation, arm = start()
    arm.start(Order(Act.PICK, "T1", 2.0, posted=7.0), HERE)
    wait(simulation, PICK_TIME)

    arm.start(Order(Act.PLACE, "T1", 2.0, posted=9.0), HERE)

    assert arm.result.outcome is PickOutcome.NOTHING_THERE
    assert arm.result.message == (
        "the load of another task 'T1' is on board, not the load of task 'T1'"
    )
