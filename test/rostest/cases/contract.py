# SPDX-License-Identifier: BSD-3-Clause
"""What any program can do that knows the topics and messages only: post tasks and follow them.

Nothing of the system is imported here but its messages.
"""

import socket

import psutil
from blackboard.msg import TaskMsg, TaskState
from hive_operator import DONE_IN_ORDER, TOLERANCE, apart, slow_motion, task
from launching import sockets_of


def test_a_task_of_every_type_is_done_with_its_states_in_order(operator):
    tasks = [
        task("C1", TaskMsg.GA, (5.5, 4.0, 1.57)),
        task("C2", TaskMsg.GAB, (3.6, 5.2, 0.0), (7.4, 8.6, 0.0), priority=3, payload=20.0),
        task("C3", TaskMsg.GPA, (13.6, 8.8, 0.0), payload=0.3),
        task("C4", TaskMsg.GPAB, (12.0, 5.6, 0.0), (16.5, 6.0, 0.0), payload=2.0),
    ]
    for each in tasks:
        assert operator.post(each).state == TaskState.WAITING
    for each in tasks:
        history, end = operator.history(each.id), operator.follow(each.id)
        said = list(operator.updates[each.id])

        # What has not begun may change hands as often as that pays.
        assert history[:2] == DONE_IN_ORDER[:2]
        assert set(history[2:-2]) <= set(DONE_IN_ORDER[:2])
        assert history[-2:] == DONE_IN_ORDER[2:]
        begun = [update for update in said if update.state == TaskState.STARTED]
        assert {update.robot_id for update in begun} == {end.robot_id}
        steps = [update.step for update in begun]
        assert steps == sorted(steps)
        assert end.step == end.steps


def test_the_robot_that_did_a_task_stands_at_its_last_goal(operator):
    operator.post(task("G1", TaskMsg.GA, (2.2, 9.0, 0.0)))
    done = operator.follow("G1")
    operator.see_until(done.robot_id, done.header.stamp)

    assert apart(operator.place(done.robot_id), (2.2, 9.0)) < TOLERANCE


def test_what_only_an_arm_can_do_goes_to_a_robot_that_has_one(operator):
    for number in range(3):
        operator.post(task(f"A{number}", TaskMsg.GPA, (14.0, 5.4, 0.0), payload=0.2))

    robots = {operator.follow(f"A{number}").robot_id for number in range(3)}
    assert robots <= {"robot3", "robot4"}


def test_the_same_task_posted_again_is_the_same_task(operator):
    again = task("S1", TaskMsg.GA, (8.8, 3.2, 0.0))
    operator.post(again)
    operator.history("S1")
    known = len(operator.updates["S1"])
    operator.post(again)

    # A repetition by the robot or the blackboard may still have been on its way.
    operator.expect(
        lambda: any(u.state == TaskState.DONE for u in operator.updates["S1"][known:]),
        "another DONE of S1",
        lambda: operator.told("S1"),
    )
    assert {u.state for u in operator.updates["S1"][known:]} == {TaskState.DONE}


def test_a_taken_id_with_other_content_is_refused_and_the_task_goes_on(operator):
    with slow_motion():
        operator.post(task("S2", TaskMsg.GA, (8.8, 3.2, 0.0)))
        other = task("S2", TaskMsg.GA, (2.2, 9.0, 0.0))
        operator.new_task.publish(other)
        operator.until("S2", TaskState.REJECTED)

    operator.until("S2", TaskState.DONE)


def test_a_cancelled_task_ends_at_once_and_its_robot_is_free_again(operator):
    with slow_motion():
        operator.post(task("X1", TaskMsg.GAB, (2.2, 9.0, 0.0), (5.5, 4.0, 0.0), (2.2, 9.0, 0.0)))
        robot = operator.until("X1", TaskState.STARTED).robot_id
        operator.cancel("X1")

    assert operator.follow("X1").state == TaskState.CANCELLED
    operator.all_idle([robot])


def test_after_all_that_no_robot_has_touched_anything(operator):
    operator.expect(lambda: operator.collisions is not None, "a count of collisions")
    assert operator.collisions == 0


def test_nothing_of_the_whole_system_listens_beyond_this_machine(operator, launches):
    launches.run(
        "roscore", "-p", str(free_port())
    )  # rostest has a master of its own in its process
    needed = {"rosout", "rosmaster", "blackboard_node", "simulator"}
    operator.expect(
        lambda: needed <= {name for name, _ in sockets_of_all()},
        f"sockets of {', '.join(sorted(needed))}",
        lambda: sorted(sockets_of_all()),
    )

    assert {address for _, address in sockets_of_all()} == {"127.0.0.1"}, sockets_of_all()


def free_port():
    """Return a port that nobody uses at this moment."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def sockets_of_all():
    """Return who listens where, of the processes that rostest began."""
    return sockets_of(psutil.Process().parent())
