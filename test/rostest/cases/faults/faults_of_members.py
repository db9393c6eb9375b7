# SPDX-License-Identifier: BSD-3-Clause
"""What happens to a hive of real nodes when some of them are killed, frozen or started twice.

One hive serves all cases; each begins when the hive is whole, and ends what it has broken.
`hive bench failover` measures how long a takeover takes.
"""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import rospy
from blackboard.msg import TaskState
from held_clock import HeldHive

from hive_lab.live.fake_base import FakeBase
from hive_lab.live.live_hive import ROBOTS
from hive_lab.live.live_operator import LiveOperator, make_task
from hive_lab.runner.limits import PATIENCE

NODES = Path(__file__).resolve().parents[2] / "nodes"

FREEZE = 5.0
"""Longer than a lease and an election [s]."""
QUIET = 2.0
"""Longer than a task waits for an answer while somebody is the leader [s]."""
TAKEOVERS = 20
"""A wanted leader that each takeover brings with 1/3 comes within this many."""
HICCUP = 0.3
"""Shorter than a leader may be without replies [s]."""
STEPS_DOWN = "is no longer the leader"
LAST_WORDS = 5
"""Most heartbeats of a leader that was frozen, before it knows that it is none: one second's."""


class HangingHive(HeldHive):
    """A hive whose nodes hang from SIGUSR1 to SIGUSR2, each of which may lead."""

    def start(self, node, *arguments, **options):
        """Start a node that can hang."""
        kind = "robot_node" if self.robot_of(node) else "blackboard_node"
        options.setdefault("program", [str(NODES / "stuck_node"), kind])
        super().start(node, *arguments, **options)


@pytest.fixture(scope="session")
def hive(tmp_path_factory):
    """A hive of a blackboard node and four robots, shared by all cases of this file."""
    rospy.init_node("faults", anonymous=True, disable_signals=True)
    hive = HangingHive(tmp_path_factory.mktemp("hive"), "/members/")
    hive.drives = {name: FakeBase(f"/members/{name}", x=float(i)) for i, name in enumerate(ROBOTS)}
    hive.operator = LiveOperator(hive.namespace, hive.members)
    try:
        for name in map(hive.node_of, hive.robots):
            hive.start(name)
        hive.start(hive.blackboard)
        yield hive
    finally:
        hive.end()


@pytest.fixture
def operator(hive):
    """The hive's operator, once the hive is complete and idle."""
    for drive in hive.drives.values():
        drive.seconds, drive.fails, drive.held = 0.1, False, False
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
        since = hive.clock.now()
        hive.kill(active)
        operator.wait_for_another(active, since)
        hive.restart_ended()
    return pytest.fail(f"after {TAKEOVERS} takeovers {active} is the leader")


def begin(hive, operator, task):
    """Post a task; return once a robot drives for it, and will until the bases are let go on."""
    for drive in hive.drives.values():
        drive.held = True
    assert operator.post(task).state == TaskState.WAITING
    # By the list: what the robot says of it may come before this program hears the robot.
    operator.demand(lambda: operator.state_of(task.id) == TaskState.STARTED, f"{task.id} is begun")


def go_on(hive):
    """Let the bases arrive."""
    for drive in hive.drives.values():
        drive.held = False


def leaders_after(operator, since):
    """Return the leaders after a time with their epochs, in order."""
    said = [(beat.epoch, beat.active) for at, beat in operator.beats if at > since]
    return [each for i, each in enumerate(said) if i == 0 or said[i - 1] != each]


def test_a_killed_blackboard_is_replaced_and_the_task_under_way_is_done_once(hive, operator):
    # A robot whose node is killed with a task has another one drive as well.
    active = takes_over(hive, operator, lambda name: name == hive.blackboard)
    begin(hive, operator, make_task("k1", (5.0, 1.0)))
    since = hive.clock.now()
    hive.kill(active)
    operator.wait_for_another(active, since)
    go_on(hive)

    assert operator.follow("k1") == TaskState.DONE
    assert sum(drive.arrivals.count((5.0, 1.0)) for drive in hive.drives.values()) == 1


def test_a_killed_robot_that_carries_the_blackboard_is_replaced_in_both_parts(hive, operator):
    active = takes_over(hive, operator, hive.robot_of)
    carrier = hive.robot_of(active)
    hive.drives[carrier].fails = True
    x = hive.drives[carrier].arrivals[-1:] or [(float(ROBOTS.index(carrier)), 0.0)]
    begin(hive, operator, make_task("c1", (x[0][0] + 0.5, 2.0), (x[0][0], 3.0)))
    since = hive.clock.now()
    hive.kill(active)
    operator.wait_for_another(active, since)
    go_on(hive)

    assert operator.follow("c1") == TaskState.DONE
    assert operator.record_of("c1").robot != carrier or operator.last.active != active


def test_the_blackboard_and_its_backup_are_killed_and_a_third_takes_over(hive, operator):
    active, backup = operator.last.active, operator.last.backup
    since = hive.clock.now()
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
    active = operator.last.active
    begin(hive, operator, make_task("m1", (2.0, 1.0)))
    worker = hive.node_of(operator.record_of("m1").robot)
    others = [name for name in hive.members if name not in {active, worker}]
    rest = others if worker != active else others[1:]
    said = hive.log_of(active).count(STEPS_DOWN)
    hive.kill(*rest[:3])
    operator.demand(lambda: hive.log_of(active).count(STEPS_DOWN) > said, f"{active} steps down")
    given_up = hive.clock.now()
    go_on(hive)
    operator.post_once(make_task("m2", (3.0, 1.0)))
    hive.clock.pass_time(QUIET)
    refused = not operator.updates["m2"]
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
    with hive.held(follower):
        hive.kill(follower)
        answer = operator.post(make_task("f1", (1.0, 2.0)))
        end = operator.follow("f1")
        hive.clock.pass_time(FREEZE)

    assert answer.state == TaskState.WAITING
    assert end == TaskState.DONE
    assert leaders_after(operator, since) == [(last.epoch, last.active)]


def test_a_blackboard_that_was_frozen_comes_back_as_a_follower(hive, operator):
    active, epoch = operator.last.active, operator.last.epoch
    since = hive.clock.now()
    hive.freeze(active)
    operator.wait_for_another(active, since)
    hive.clock.pass_time(since + FREEZE - hive.clock.now())
    back, since_back = hive.clock.now(), time.monotonic()
    hive.thaw(active)
    operator.post(make_task("z1", (1.0, 3.0)))
    operator.demand(lambda: operator.last.epoch > epoch, "the new epoch is heard")

    assert operator.follow("z1") == TaskState.DONE
    operator.wait_until_whole()
    assert all(e > epoch or who == active for e, who in leaders_after(operator, since_back))
    late = [beat for _, beat in operator.beats if beat.sent > back and beat.epoch <= epoch]
    assert len(late) <= LAST_WORDS
    assert STEPS_DOWN in hive.log_of(active)


def test_a_blackboard_that_is_frozen_for_a_moment_stays_the_active_one(hive, operator):
    active, epoch = operator.last.active, operator.last.epoch
    since = time.monotonic()
    with hive.held():  # so that its last heartbeat is a young one
        hive.clock.pass_time(HICCUP)
    hive.freeze(active)
    hive.clock.pass_time(HICCUP)
    with hive.held():
        hive.thaw(active)
        hive.clock.pass_time(FREEZE)

    assert leaders_after(operator, since) == [(epoch, active)]


def test_a_node_whose_own_thread_hangs_is_replaced_though_its_process_answers(hive, operator):
    active, epoch = operator.last.active, operator.last.epoch
    since = hive.clock.now()
    hive.signal(active, signal.SIGUSR1)
    operator.wait_for_another(active, since)
    hive.signal(active, signal.SIGUSR2)

    operator.wait_until_whole()
    assert operator.last.epoch > epoch


def test_a_second_blackboard_of_another_name_is_a_member_like_the_others(hive, operator):
    last = operator.last
    second = "/members/blackboard2"
    rospy.set_param(second, rospy.get_param(hive.blackboard))
    since = time.monotonic()
    with hive.held():
        hive.start(second)
        operator.demand(lambda: second in operator.last.members, "the second is a member")

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
    before = sum(drive.begun for drive in hive.drives.values())
    subprocess.run([sys.executable, "-c", program], check=False, timeout=PATIENCE)
    answer = operator.post(make_task("orphan", (1.5, 1.5)))

    assert answer.state != TaskState.REJECTED
    assert operator.follow("orphan") == TaskState.DONE
    assert sum(drive.arrivals.count((1.5, 1.5)) for drive in hive.drives.values()) == 1
    assert sum(drive.begun for drive in hive.drives.values()) == before + 1


def test_a_program_that_posts_before_it_is_connected_is_heard_when_it_repeats(hive, operator):
    late = LiveOperator(hive.namespace, hive.members)

    assert late.post(make_task("early", (2.5, 2.5))).state == TaskState.WAITING
    assert operator.follow("early") == TaskState.DONE
