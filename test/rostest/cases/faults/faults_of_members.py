# SPDX-License-Identifier: BSD-3-Clause
"""What happens to a hive of real nodes when some of them are killed, frozen or started twice.

One hive serves all cases; each begins when the hive is whole, and ends what it has broken.
"""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import rospy
from blackboard.msg import TaskState

from hive_lab.live.fake_base import FakeBase
from hive_lab.live.live_hive import ROBOTS, LiveHive
from hive_lab.live.live_operator import PATIENCE, LiveOperator, make_task

NODES = Path(__file__).resolve().parents[2] / "nodes"

TAKEOVER = 3.5
"""Time for another member to take over, whatever happened to the leader [s]."""
CRASH = 3.0
"""The same after a proven death [s]; docs/benchmarks.md has the measured times."""
FREEZE = 5.0
"""Longer than a lease and an election [s]."""
WITHOUT_MAJORITY = 1.8
"""Time for a leader without a majority to step down [s]."""
TAKEOVERS = 20
"""A wanted leader that each takeover brings with 1/3 comes within this many."""
HICCUP = 0.8
"""Shorter than a leader may be without replies [s]."""


@pytest.fixture(scope="session")
def hive(tmp_path_factory):
    """A hive of a blackboard node and four robots, shared by all cases of this file."""
    rospy.init_node("faults", anonymous=True, disable_signals=True)
    hive = LiveHive(tmp_path_factory.mktemp("hive"), "/members/")
    hive.drives = {name: FakeBase(f"/members/{name}", x=float(i)) for i, name in enumerate(ROBOTS)}
    hive.operator = LiveOperator(hive.namespace, hive.members)
    try:
        for name in map(hive.node_of, hive.robots):
            hive.start(name)
        hive.start(hive.blackboard, program=[sys.executable, str(NODES / "stuck_blackboard")])
        yield hive
    finally:
        hive.end()


@pytest.fixture
def operator(hive):
    """The hive's operator, once the hive is complete and idle."""
    for drive in hive.drives.values():
        drive.seconds, drive.fails = 0.1, False
    hive.operator.wait_until_whole()
    yield hive.operator
    hive.operator.forget_answers()
    for name in hive.members:
        if name not in hive.ended():
            hive.thaw(name)
    hive.restart_ended()


def takes_over(hive, operator, wanted):
    """Kill the leader until it is of the wanted kind; return its name.

    The backup is the first candidate, but another member with proof of the death may win.
    """
    for _ in range(TAKEOVERS):
        active = operator.wait_until_whole()
        if wanted(active):
            return active
        operator.forget_answers()
        since = time.monotonic()
        hive.kill(active)
        operator.wait_for_another(active, since)
        hive.restart_ended()
    return pytest.fail(f"after {TAKEOVERS} takeovers {active} is the leader")


def is_busy(operator, task_id):
    return lambda: TaskState.STARTED in operator.states_of(task_id)


def leaders_after(operator, since):
    """Return the leaders after a time with their epochs, in order."""
    said = [(beat.epoch, beat.active) for at, beat in operator.beats if at > since]
    return [each for i, each in enumerate(said) if i == 0 or said[i - 1] != each]


def test_a_killed_blackboard_is_replaced_and_the_task_under_way_is_done_once(hive, operator):
    for drive in hive.drives.values():
        drive.seconds = 2.0
    # A robot whose node is killed with a task has another one drive as well.
    active = takes_over(hive, operator, lambda name: name == hive.blackboard)
    assert operator.post(make_task("k1", (5.0, 1.0))).state == TaskState.WAITING
    operator.demand(is_busy(operator, "k1"), "k1 is begun")
    since = time.monotonic()
    hive.kill(active)
    gap = operator.wait_for_another(active, since)

    assert gap < CRASH
    assert operator.follow("k1") == TaskState.DONE
    assert sum(drive.arrivals.count((5.0, 1.0)) for drive in hive.drives.values()) == 1


def test_a_killed_robot_that_carries_the_blackboard_is_replaced_in_both_parts(hive, operator):
    active = takes_over(hive, operator, hive.robot_of)
    carrier = hive.robot_of(active)
    for drive in hive.drives.values():
        drive.seconds = 2.0
    hive.drives[carrier].fails = True
    x = hive.drives[carrier].arrivals[-1:] or [(float(ROBOTS.index(carrier)), 0.0)]
    operator.post(make_task("c1", (x[0][0] + 0.5, 2.0), (x[0][0], 3.0)))
    operator.demand(is_busy(operator, "c1"), "c1 is begun")
    since = time.monotonic()
    hive.kill(active)
    gap = operator.wait_for_another(active, since)

    assert gap < CRASH
    assert operator.follow("c1") == TaskState.DONE
    assert operator.record_of("c1").robot != carrier or operator.last.active != active


def test_the_blackboard_and_its_backup_are_killed_and_a_third_takes_over(hive, operator):
    active, backup = operator.last.active, operator.last.backup
    since = time.monotonic()
    hive.kill(active, backup)
    operator.demand(
        lambda: any(
            beat.sent > since and beat.active not in {active, backup} for _, beat in operator.beats
        ),
        "a third takes over",
    )

    assert operator.post(make_task("third", (1.0, 1.0))).state == TaskState.WAITING
    assert operator.follow("third") == TaskState.DONE


def test_without_a_majority_the_task_under_way_is_finished_and_nothing_is_taken_in(hive, operator):
    for drive in hive.drives.values():
        drive.seconds = 1.0
    active = operator.last.active
    operator.post(make_task("m1", (2.0, 1.0)))
    operator.demand(is_busy(operator, "m1"), "m1 is begun")
    begun = [u for u in operator.updates["m1"] if u.state == TaskState.STARTED]
    worker = hive.node_of(begun[0].robot_id)
    others = [name for name in hive.members if name not in {active, worker}]
    rest = others if worker != active else others[1:]
    hive.kill(*rest[:3])
    given_up = time.monotonic() + WITHOUT_MAJORITY
    operator.pass_time(WITHOUT_MAJORITY + 0.2)
    operator.post_once(make_task("m2", (3.0, 1.0)))
    refused = not operator.wait(lambda: operator.updates["m2"], 2.0)
    beats_after = [beat for _, beat in operator.beats if beat.sent > given_up]
    hive.restart_ended()

    assert beats_after == []
    assert refused
    assert operator.follow("m1") == TaskState.DONE
    assert sum(drive.arrivals.count((2.0, 1.0)) for drive in hive.drives.values()) == 1
    assert operator.post(make_task("m2", (3.0, 1.0))).state == TaskState.WAITING
    assert operator.follow("m2") == TaskState.DONE


def test_a_killed_follower_changes_nothing(hive, operator):
    last = operator.last
    follower = next(n for n in hive.members if n not in {last.active, last.backup})
    since = time.monotonic()
    hive.kill(follower)

    assert operator.post(make_task("f1", (1.0, 2.0))).state == TaskState.WAITING
    assert operator.follow("f1") == TaskState.DONE
    assert leaders_after(operator, since) == [(last.epoch, last.active)]


def test_a_blackboard_that_was_frozen_comes_back_as_a_follower(hive, operator):
    active, epoch = operator.last.active, operator.last.epoch
    since = time.monotonic()
    hive.freeze(active)
    gap = operator.wait_for_another(active, since)
    operator.pass_time(since + FREEZE - time.monotonic())
    hive.thaw(active)
    back = time.monotonic()
    operator.post(make_task("z1", (1.0, 3.0)))
    operator.demand(lambda: operator.last.epoch > epoch, "the new epoch is heard")

    assert gap < TAKEOVER
    assert operator.follow("z1") == TaskState.DONE
    operator.wait_until_whole()
    assert all(e > epoch or who == active for e, who in leaders_after(operator, back))
    late = [beat for _, beat in operator.beats if beat.sent > back + 1 and beat.epoch <= epoch]
    assert late == []
    assert "is no longer the leader" in hive.log_of(active)


def test_a_blackboard_that_is_frozen_for_less_than_a_second_stays_the_active_one(hive, operator):
    for _ in range(5):
        active, epoch = operator.last.active, operator.last.epoch
        since = time.monotonic()
        hive.freeze(active)
        operator.pass_time(HICCUP)
        hive.thaw(active)
        if time.monotonic() - since < HICCUP + 0.2:
            break
        # It was frozen for longer, because this program was held up as well.
        operator.forget_answers()
        operator.wait_until_whole()
    else:
        pytest.fail("this machine lets no freeze be that short")
    operator.pass_time(2.0)

    assert leaders_after(operator, since) == [(epoch, active)]


def test_a_node_whose_own_thread_hangs_is_replaced_though_its_process_answers(hive, operator):
    takes_over(hive, operator, lambda name: name != hive.blackboard)
    hive.kill(hive.blackboard)
    operator.forget_answers()
    # The one before may be the plain node, which SIGUSR1 ends.
    hive.start(hive.blackboard, program=[sys.executable, str(NODES / "stuck_blackboard")])
    takes_over(hive, operator, lambda name: name == hive.blackboard)
    active, epoch = operator.last.active, operator.last.epoch
    since = time.monotonic()
    hive.signal(active, signal.SIGUSR1)
    gap = operator.wait_for_another(active, since)

    assert gap < TAKEOVER
    operator.wait_until_whole()
    assert operator.last.epoch > epoch


def test_a_second_blackboard_of_another_name_is_a_member_like_the_others(hive, operator):
    last = operator.last
    second = "/members/blackboard2"
    rospy.set_param(second, rospy.get_param(hive.blackboard))
    since = time.monotonic()
    hive.start(second)
    operator.demand(lambda: second in operator.last.members, "the second blackboard is a member")

    assert leaders_after(operator, since) == [(last.epoch, last.active)]
    hive.kill(second)
    operator.demand(lambda: second not in operator.last.members, "it is off the list")
    del hive._processes[second]  # noqa: SLF001  (it is not to be started again)


def test_a_second_blackboard_of_the_same_name_takes_the_first_ones_place(hive, operator):
    name = hive.blackboard
    first = hive._processes[name]  # noqa: SLF001  (start replaces it)
    hive.start(name)
    first.wait(PATIENCE)
    operator.forget_answers()
    operator.wait_until_whole()
    epochs = {beat.epoch: set() for _, beat in operator.beats}
    for _, beat in operator.beats:
        epochs[beat.epoch].add(beat.active)

    assert all(len(who) == 1 for who in epochs.values())
    assert operator.post(make_task("same-name", (2.0, 2.0))).state == TaskState.WAITING
    assert operator.follow("same-name") == TaskState.DONE


def test_what_is_posted_during_a_takeover_is_taken_in_once(hive, operator):
    active = operator.last.active
    before = sum(drive.begun for drive in hive.drives.values())
    hive.kill(active)
    for _ in range(100):
        operator.post_once(make_task("hundred", (4.0, 4.0)))
    operator.post(make_task("hundred", (4.0, 4.0)))

    assert operator.follow("hundred") == TaskState.DONE
    assert sum(drive.begun for drive in hive.drives.values()) == before + 1


def test_the_same_task_a_hundred_times_is_one_task(hive, operator):
    before = sum(drive.begun for drive in hive.drives.values())
    for _ in range(100):
        operator.post_once(make_task("again", (4.0, 1.0)))
    operator.post(make_task("again", (4.0, 1.0)))

    assert operator.follow("again") == TaskState.DONE
    assert sum(drive.begun for drive in hive.drives.values()) == before + 1


def test_a_program_that_dies_right_after_it_has_posted_leaves_at_most_one_task(hive, operator):
    program = (
        "import os, rospy; from blackboard.msg import TaskMsg; "
        "from hive_lab.live.live_operator import make_task; "
        "rospy.init_node('dying', anonymous=True); "
        "p = rospy.Publisher('/members/new_task', TaskMsg, queue_size=1, latch=True); "
        "p.publish(make_task('orphan', (1.5, 1.5))); rospy.sleep(0.3); os._exit(9)"
    )
    subprocess.run([sys.executable, "-c", program], check=False, timeout=PATIENCE)
    begun = sum(drive.begun for drive in hive.drives.values())
    told = operator.wait(lambda: operator.updates["orphan"], 2.0)
    answer = operator.post(make_task("orphan", (1.5, 1.5)))

    assert answer.state != TaskState.REJECTED
    assert operator.follow("orphan") == TaskState.DONE
    assert sum(drive.arrivals.count((1.5, 1.5)) for drive in hive.drives.values()) == 1
    assert told or sum(drive.begun for drive in hive.drives.values()) == begun + 1


def test_a_program_that_posts_before_it_is_connected_is_heard_when_it_repeats(hive, operator):
    late = LiveOperator(hive.namespace, hive.members)

    assert late.post(make_task("early", (2.5, 2.5))).state == TaskState.WAITING
    assert operator.follow("early") == TaskState.DONE
