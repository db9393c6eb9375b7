# SPDX-License-Identifier: BSD-3-Clause
"""What the report's test plan leaves out about tasks: who may do what, and what nobody may."""

import math

import pytest
from blackboard.msg import RobotStatus, TaskMsg, TaskState
from hive_operator import HOME, STATES, slow_motion, task

BAD = {
    "unknown-type": ((9, (5.5, 4.0, 0.0)), {}, "type 9"),
    "too-few-goals": ((TaskMsg.GAB, (5.5, 4.0, 0.0)), {}, "1 goal"),
    "no-goals": ((TaskMsg.GA,), {}, "0 goals"),
    "nan": ((TaskMsg.GA, (math.nan, 4.0, 0.0)), {}, "nan"),
    "infinite-heading": ((TaskMsg.GA, (5.5, 4.0, math.inf)), {}, "inf"),
    "outside-the-map": ((TaskMsg.GA, (99.0, 4.0, 0.0)), {}, "outside the map"),
    "inside-a-wall": ((TaskMsg.GA, (10.0, 11.0, 0.0)), {}, "wall"),
    "negative-payload": ((TaskMsg.GA, (5.5, 4.0, 0.0)), {"payload": -1.0}, "payload -1"),
    "nan-payload": ((TaskMsg.GA, (5.5, 4.0, 0.0)), {"payload": math.nan}, "payload nan"),
    "priority-11": ((TaskMsg.GA, (5.5, 4.0, 0.0)), {"priority": 11}, "priority 11"),
    "unknown-frame": ((TaskMsg.GA, (5.5, 4.0, 0.0)), {"frame": "moon"}, "moon"),
}
"""What each bad task is: type and goals, options, and what the reason must say."""


@pytest.mark.plan(
    "bad tasks",
    "Every bad task is refused",
    "REJECTED, with a reason that names what is wrong; the task never enters the list",
)
@pytest.mark.parametrize("what", BAD)
def test_a_bad_task_is_rejected_with_a_reason_that_names_what_is_wrong(operator, what, observed):
    arguments, options, said = BAD[what]
    answer = operator.post(task(what, *arguments, **options))
    observed(f"{what}: {answer.reason}")

    assert answer.state == TaskState.REJECTED
    assert said in answer.reason
    assert what not in operator.list


@pytest.mark.plan(
    "filters",
    "Payload and type",
    "a robot that cannot carry, lift or do a task bids 1000 and says why; only one that can gets "
    "it",
)
def test_robots_that_cannot_do_a_task_refuse_it_and_say_why(operator, observed):
    operator.all_idle()
    operator.post(task("R-80kg", TaskMsg.GA, HOME[0], payload=80.0))
    operator.post(task("R-pick", TaskMsg.GPA, (12.0, 9.0, 0.0), payload=2.0))
    heavy, pick = operator.refusals("R-80kg"), operator.refusals("R-pick")
    observed(f"80 kg: {heavy}; a GPA of 2 kg: {pick}")

    assert [robot for robot, reason in heavy.items() if not reason] == ["robot1"]
    assert [robot for robot, reason in pick.items() if not reason] == ["robot4"]
    assert operator.follow("R-80kg").robot_id == "robot1"
    assert operator.follow("R-pick").robot_id == "robot4"


@pytest.mark.plan(
    "too heavy",
    "A task too heavy for one robot",
    "150 kg are split into two parts that two robots carry; the whole is DONE with the last part",
)
def test_a_task_too_heavy_for_one_robot_is_done_in_parts(operator, observed):
    operator.all_idle()
    # Both parts are auctioned at once: the lighter one goes to the robot that is there already.
    a = (*operator.place("robot2"), 0.0)
    operator.post(task("R-heavy", TaskMsg.GAB, a, (5.5, 4.0, 0.0), payload=150.0))
    whole = operator.follow("R-heavy")
    operator.expect(
        lambda: operator.list["R-heavy"].state == TaskState.DONE,
        "R-heavy DONE on bb_sync",
        lambda: operator.list["R-heavy"],
    )
    parts = {i: r for i, r in operator.list.items() if r.parent == "R-heavy"}
    said = [f"{i} of {r.task.payload:g} kg by {r.robot}" for i, r in parts.items()]
    observed("; ".join(said))

    assert whole.state == TaskState.DONE
    assert {record.robot for record in parts.values()} == {"robot1", "robot2"}
    assert sum(record.task.payload for record in parts.values()) == pytest.approx(150.0)
    assert {record.state for record in parts.values()} == {TaskState.DONE}


def test_the_same_task_posted_again_is_the_same_task(operator):
    again = task("R-again", TaskMsg.GA, HOME[1])
    operator.post(again)
    operator.history("R-again")
    known = len(operator.updates["R-again"])
    operator.post(again)

    # A repetition by the robot or the blackboard may still have been on its way.
    operator.expect(
        lambda: any(u.state == TaskState.DONE for u in operator.updates["R-again"][known:]),
        "another DONE of R-again",
        lambda: operator.told("R-again"),
    )
    assert {update.state for update in operator.updates["R-again"][known:]} == {TaskState.DONE}


def test_a_taken_id_with_other_content_is_refused_and_the_task_goes_on(operator):
    with slow_motion():
        operator.post(task("R-taken", TaskMsg.GA, HOME[0]))
        operator.new_task.publish(task("R-taken", TaskMsg.GA, HOME[1]))
        refused = operator.until("R-taken", TaskState.REJECTED)

    assert "taken" in refused.reason
    operator.until("R-taken", TaskState.DONE)


@pytest.mark.plan(
    "cancel",
    "Cancelling in each state",
    "WAITING, ASSIGNED and STARTED tasks are CANCELLED; what was not begun never begins; the "
    "robot that was at work is free again",
)
def test_a_task_is_cancelled_whatever_its_state(operator, observed):
    operator.all_idle()
    for robot in ("robot3", "robot4"):
        operator.set_state(robot, "defect", RobotStatus.DEFECT)
    operator.post(task("R-waits", TaskMsg.GPA, (12.0, 9.0, 0.0), payload=0.2))
    goals = ((8.8, 9.0, 0.0), HOME[0])
    with slow_motion():
        operator.post(task("R-begun", TaskMsg.GAB, *goals, payload=80.0))
        operator.until("R-begun", TaskState.STARTED)
        operator.post(task("R-next", TaskMsg.GAB, *goals, payload=80.0))
        operator.until("R-next", TaskState.ASSIGNED)
        before = {i: operator.updates[i][-1].state for i in ("R-waits", "R-next", "R-begun")}
        for task_id in before:
            operator.cancel(task_id)
    ends = {task_id: operator.follow(task_id).state for task_id in before}
    operator.all_idle(["robot1", "robot2"])
    for robot in ("robot3", "robot4"):
        operator.set_state(robot, "idle", RobotStatus.IDLE)
    observed(", ".join(f"{STATES[before[i]]} to {STATES[ends[i]]}" for i in before))

    assert before["R-waits"] == TaskState.WAITING
    assert before["R-next"] == TaskState.ASSIGNED
    assert set(ends.values()) == {TaskState.CANCELLED}
    assert not operator.said("R-waits", TaskState.ASSIGNED)
    assert not operator.said("R-next", TaskState.STARTED)
