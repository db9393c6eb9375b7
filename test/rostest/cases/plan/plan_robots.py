# SPDX-License-Identifier: BSD-3-Clause
"""What the report's test plan leaves out about robots: that come, go and break.

The order is that of the file: each case leaves a fleet that the next one can use, and the one that
kills a robot is the last.
"""

from itertools import product
from pathlib import Path

import pytest
import rosbag
import rospy
from blackboard.msg import RobotStatus, TaskCost, TaskMsg, TaskState
from hive_operator import HOME, ROBOTS, STATES, Operator, apart, slow_motion, task
from launching import Launches, kill, wait_until_empty
from simenv.srv import Remove

from hive_lab.live.connections import is_heard

PORTER = Path(__file__).resolve().parents[2] / "models" / "porter.yaml"
SECOND_FLEET = Path(__file__).resolve().parents[2] / "launch" / "second_fleet.launch"


@pytest.fixture(scope="module")
def launches():
    launches = Launches()
    yield launches
    launches.stop()


def carry_away(robot):
    """Remove a robot that does not drive any more from the others' way."""
    answer = rospy.ServiceProxy("/simenv/remove", Remove)(name=robot)
    assert answer.success, answer.message


@pytest.mark.plan(
    "defect",
    "A robot set defect under way",
    "it hands its task back and another robot does it; set idle, it is back in service",
)
def test_what_a_defect_robot_had_is_done_by_another(operator, observed):
    operator.all_idle()
    with slow_motion():
        operator.post(task("R-defect", TaskMsg.GAB, (8.8, 9.0, 0.0), HOME[1], payload=58.0))
        first = operator.until("R-defect", TaskState.STARTED).robot_id
        operator.set_state(first, "defect", RobotStatus.DEFECT)
    end = operator.follow("R-defect")
    refused = operator.refusals("R-defect", which=-1)[first]
    operator.set_state(first, "idle", RobotStatus.IDLE)
    observed(f"begun by {first}, which bids 1000 ({refused}); done by {end.robot_id}")

    assert end.state == TaskState.DONE
    assert {first, end.robot_id} == {"robot1", "robot2"}
    assert "defect" in refused


@pytest.mark.plan(
    "rosbag",
    "Recording a run and playing it back",
    "the recorded task_state, played back, tells the same history of every task",
)
def test_a_recorded_run_tells_the_same_history_of_tasks(operator, launches, tmp_path, observed):
    operator.all_idle()
    bag = tmp_path / "run.bag"
    record = launches.run("rosbag", "record", "-O", str(bag), "/task_state", "__name:=recorder")
    for node in ("/blackboard", *(f"/{robot}/robot" for robot in ROBOTS)):
        while not is_heard(node, "/task_state", "/recorder"):
            operator.wait(lambda: record.poll() is not None, 0.1)
            assert record.poll() is None, "rosbag record has ended by itself"
    operator.post(task("B-bad", TaskMsg.GA, (99.0, 0.0, 0.0)))
    for number, goal in enumerate(HOME):
        operator.post(task(f"B{number}", TaskMsg.GA, goal, payload=58.0))
    live = [operator.history("B0"), operator.history("B1")]
    # By its answer to a last task, what the hive said before has come to the recorder too.
    operator.post(task("B-end", TaskMsg.GA, (99.0, 0.0, 0.0)))
    operator.all_idle()
    launches.stop(record)
    replayed = Operator("/replayed/", robots=())
    # Kept alive past the end of the bag: a player that ends drops what it has not sent yet.
    options = ["--quiet", "--keep-alive", "-r", "20", "--wait-for-subscribers"]
    elsewhere = [f"/{topic}:=/replayed/{topic}" for topic in ("task_state", "clock")]
    play = launches.run("rosbag", "play", *options, str(bag), *elsewhere)
    with rosbag.Bag(str(bag)) as recorded:
        count = recorded.get_message_count()
    replayed.expect(
        lambda: sum(map(len, replayed.updates.values())) == count,
        f"all {count} recorded messages",
        lambda: {task_id: len(updates) for task_id, updates in replayed.updates.items()},
    )
    launches.stop(play)
    states = ", ".join(STATES[state] for state in live[0])
    observed(f"{count} messages on {', '.join(sorted(replayed.updates))}; of B0 {states}")

    for task_id in ("B0", "B1", "B-bad"):
        assert told_in(replayed, task_id) == told_in(operator, task_id)


def told_in(operator, task_id):
    """Return what an operator has heard of a task by the stamps in it, repetitions left out.

    What a robot and the blackboard say at one time comes to each listener in another order.
    """
    updates = operator.updates[task_id]
    told = {(u.header.stamp, u.state, u.robot_id, u.step, u.reason) for u in updates}
    return list(dict.fromkeys(each[1:] for each in sorted(told)))


@pytest.fixture(scope="module")
def newcomer(operator, launches):
    """A robot of an unknown make with an all but empty battery, which joins the running fleet."""
    place = {"x": 18.4, "y": 5.6}  # where no case before has sent a robot
    operator.watch("robot5")
    launch = launches.start(
        "fleet_manager", "robot.launch", name="robot5", model=PORTER, charge=0.1, **place
    )
    operator.expect(
        lambda: "robot5" in operator.robots and operator.robots["robot5"].hive,
        "a status of robot5 that names the hive",
        lambda: operator.robots.get("robot5"),
    )
    here, new = rospy.get_name(), "/robot5/robot"
    members = ("/blackboard", *(f"/{robot}/robot" for robot in (*ROBOTS, "robot5")))
    links = [
        *product(members, ("/task_bc", "/task_assign"), [new]),
        *product([new], ("/task_cost", "/robot_status"), [*members, here]),
        (new, "/task_state", here),
        ("/robot5/move_base", "/robot5/move_base/status", new),
    ]
    wait_until_empty(lambda: [link for link in links if not is_heard(*link)])
    operator.hear_again("robot5")
    return launch


@pytest.mark.plan(
    "low battery",
    "Low battery",
    "a robot at 10 % bids 1000 and says why; set charging it is out of service until it is full, "
    "then it bids and works",
)
@pytest.mark.usefixtures("newcomer")
def test_a_robot_with_a_low_battery_refuses_until_it_is_charged(operator, observed):
    operator.post(task("R-low", TaskMsg.GA, (17.2, 5.6, 0.0)))
    operator.expect(lambda: "robot5" in operator.bids["R-low"], "robot5's bid on R-low")
    low = operator.bids["R-low"]["robot5"][0]
    operator.cancel("R-low")
    operator.set_state("robot5", "charging", RobotStatus.CHARGING)
    operator.expect(
        lambda: operator.robots["robot5"].state == RobotStatus.IDLE,
        "robot5 back in service",
        lambda: operator.robots["robot5"],
    )
    # The blackboard may have heard it later than this program.
    operator.hear_again("robot5")
    charge = operator.robots["robot5"].charge
    # It had set out for a charger by itself; nobody is nearer to where it has stopped.
    operator.post(task("R-charged", TaskMsg.GA, (*operator.place("robot5"), 0.0)))
    done = operator.follow("R-charged")
    observed(
        f"bid {low.cost:g} at 10 %: {low.reason}; after charging {charge:.0%} and a bid of "
        f"{operator.bids['R-charged']['robot5'][0].cost:.1f}"
    )

    assert low.cost == TaskCost.MAX_COST
    assert "charge" in low.reason
    assert charge > 0.95
    assert (done.state, done.robot_id) == (TaskState.DONE, "robot5")


@pytest.mark.plan(
    "expanding",
    "Expanding the fleet with any robot, and leaving it",
    "a robot of an unknown make joins without a restart, gets a vote and, while the others are "
    "defect, a task; when it has left, it is OFFLINE, and its task is done by another",
)
def test_an_unknown_robot_joins_works_and_leaves(operator, newcomer, launches, observed):
    operator.expect(
        lambda: operator.heartbeat and "/robot5/robot" in operator.heartbeat.members,
        "robot5 among the members",
        lambda: operator.heartbeat.members,
    )
    members = len(operator.heartbeat.members)
    goals = ((18.0, 5.6, 0.0), (18.0, 9.0, 0.0))
    for robot in ROBOTS:
        operator.set_state(robot, "defect", RobotStatus.DEFECT)
    with slow_motion():
        operator.post(task("R-left", TaskMsg.GAB, *goals))
        worker = operator.until("R-left", TaskState.STARTED).robot_id
        launches.stop(newcomer)
    operator.expect(
        lambda: operator.robots["robot5"].state == RobotStatus.OFFLINE,
        "robot5 OFFLINE",
        lambda: operator.robots["robot5"],
    )
    carry_away("robot5")
    for robot in ROBOTS:
        operator.set_state(robot, "idle", RobotStatus.IDLE)
    end = operator.follow("R-left")
    observed(
        f"{members} members with robot5; R-left begun by {worker}; robot5 left and was OFFLINE; "
        f"R-left done by {end.robot_id}"
    )

    assert worker == "robot5"
    assert end.state == TaskState.DONE
    assert end.robot_id in ROBOTS


@pytest.mark.plan(
    "second fleet",
    "A second fleet in another namespace on the same master",
    "a task posted to it is done by its robot; the first fleet hears of neither, and may use the "
    "same id for a task of its own",
)
def test_two_fleets_on_one_master_do_not_mix(operator, launches, observed):
    launch = launches.run("roslaunch", str(SECOND_FLEET))
    east = Operator("/east/", robots=("robot6",))
    east.expect(lambda: "robot6" in east.robots, "a status of robot6 on /east/robot_status")
    goal = (14.6, 3.4, 0.0)
    east.post(task("S1", TaskMsg.GA, goal))
    theirs = east.follow("S1")
    east.see_until("robot6", theirs.header.stamp)
    place = east.place("robot6")
    heard = list(operator.updates["S1"])
    operator.post(task("S1", TaskMsg.GA, HOME[0], payload=58.0))
    ours = operator.follow("S1")
    launches.stop(launch)
    observed(f"S1 of /east done by {theirs.robot_id}, S1 of the first fleet by {ours.robot_id}")

    assert heard == []
    assert (theirs.state, theirs.robot_id) == (TaskState.DONE, "robot6")
    assert apart(place, goal) < 0.15
    assert ours.robot_id in ROBOTS
    assert "robot6" not in operator.robots
    assert set(east.robots) == {"robot6"}


@pytest.mark.plan(
    "killed robot",
    "A robot killed under way",
    "it is OFFLINE, its task is given to another robot once the lease has ended, and is done",
)
def test_the_task_of_a_robot_that_was_killed_is_done_by_another(operator, observed):
    operator.all_idle()
    with slow_motion():
        operator.post(task("R-killed", TaskMsg.GAB, (8.8, 9.0, 0.0), HOME[1], payload=58.0))
        first = operator.until("R-killed", TaskState.STARTED).robot_id
        kill(f"/{first}/robot", f"/{first}/move_base")
    operator.expect(
        lambda: operator.robots[first].state == RobotStatus.OFFLINE,
        f"{first} OFFLINE",
        lambda: operator.robots[first],
    )
    carry_away(first)
    end = operator.follow("R-killed")
    observed(f"begun by {first}, which was killed and was OFFLINE; done by {end.robot_id}")

    assert end.state == TaskState.DONE
    assert {first, end.robot_id} == {"robot1", "robot2"}
