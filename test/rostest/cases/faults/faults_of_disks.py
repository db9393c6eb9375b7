# SPDX-License-Identifier: BSD-3-Clause
"""A hive of real nodes that lose power, or whose disks are lost, torn or full."""

import contextlib
import os
import subprocess

import pytest
import rospy
from blackboard.msg import TaskState
from held_clock import PATIENT, STEADY
from launching import run_hive

from hive_lab.live.fake_base import FakeBase
from hive_lab.live.live_hive import ROBOTS, LiveHive
from hive_lab.live.live_operator import LiveOperator, make_task

BAD_INPUT = 2
"""The exit code of a command whose arguments or files cannot be used."""

SIZE = 16
"""Size of the small disk [MB]: SQLite's write-ahead log alone may grow to 4 MB."""


@pytest.fixture(scope="session")
def small_disk(tmp_path_factory):
    """A small file system; None where none can be mounted."""
    folder = tmp_path_factory.mktemp("disk")
    mount = ["mount", "-t", "tmpfs", "-o", f"size={SIZE}m", "robo-hive-test", str(folder)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True, check=False).returncode:
        yield None
        return
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=False)


@pytest.fixture(scope="session")
def hive(small_disk, tmp_path_factory):
    """A hive whose blackboard node writes to the small disk, if there is one."""
    rospy.init_node("faults", anonymous=True, disable_signals=True)
    disk = STEADY | ({"journal": str(small_disk)} if small_disk else {})
    hive = LiveHive(tmp_path_factory.mktemp("hive"), "/disks/", blackboard=disk, robot=PATIENT)
    hive.drives = [FakeBase(f"/disks/{name}", x=float(i)) for i, name in enumerate(ROBOTS)]
    hive.operator = LiveOperator(hive.namespace, hive.members)
    try:
        hive.start_all()
        yield hive
    finally:
        hive.end()


@pytest.fixture
def operator(hive):
    """The hive's operator, once the hive is complete."""
    for drive in hive.drives:
        drive.seconds = 0.1
    hive.operator.wait_until_whole()
    yield hive.operator
    hive.operator.forget_answers()
    hive.restart_ended()


def a_follower(hive, operator):
    busy = {operator.last.active, operator.last.backup}
    return next(hive.node_of(r) for r in hive.robots if hive.node_of(r) not in busy)


def test_an_active_blackboard_whose_disk_is_full_steps_down_and_says_so(
    hive, operator, small_disk
):
    if small_disk is None:
        pytest.skip("a file system can be mounted by root only")
    while operator.last.active != hive.blackboard:
        hive.kill(operator.last.active)
        operator.forget_answers()
        hive.restart_ended()
        operator.wait_until_whole()
    filler = small_disk / "filler"
    try:
        with filler.open("wb", buffering=0) as file, contextlib.suppress(OSError):
            while file.write(bytes(4096)):
                pass
        answer = operator.post(make_task("full", (1.0, 1.0)))
        log = hive.log_of(hive.blackboard)
    finally:
        filler.unlink()

    # Posted again while another takes over, it may have been done by the time it is answered.
    assert answer.state != TaskState.REJECTED
    assert operator.last.active != hive.blackboard
    assert operator.follow("full") == TaskState.DONE
    assert "cannot take part in the hive" in log
    assert "free the disk" in log


def test_after_a_power_cut_of_all_every_task_that_was_taken_in_is_done(hive, operator):
    for drive in hive.drives:
        drive.seconds = 3.0
    tasks = [f"power{i}" for i in range(8)]
    answers = [operator.post(make_task(t, (float(i), 1.0))) for i, t in enumerate(tasks)]
    hive.kill(*hive.members)
    for drive in hive.drives:
        drive.cancel_all()
        drive.seconds = 0.1
    operator.forget_answers()
    hive.restart_ended()
    operator.wait_until_whole()

    assert {answer.state for answer in answers} == {TaskState.WAITING}
    assert {operator.follow(task) for task in tasks} == {TaskState.DONE}


def test_a_robot_whose_disk_was_lost_comes_back_as_a_new_member(hive, operator):
    node = a_follower(hive, operator)
    before = operator.lives[node]
    hive.kill(node)
    for file in hive.journals.glob(f"{hive.journal_of(node).stem}.*"):
        file.unlink()
    operator.forget_answers()
    hive.start(node)
    operator.demand(lambda: operator.lives[node] != before, f"{node} has another id")
    operator.wait_until_whole()

    assert operator.post(make_task("new-disk", (2.0, 2.0))).state == TaskState.WAITING
    assert operator.follow("new-disk") == TaskState.DONE
    operator.demand(
        lambda: operator.acknowledged[node] == operator.last.version, f"{node} has the list again"
    )


def test_a_journal_that_is_torn_is_set_aside_and_said(hive, operator):
    node = a_follower(hive, operator)
    path = hive.journal_of(node)
    hive.kill(node)
    for file in hive.journals.glob(f"{path.name}-*"):
        file.unlink()
    torn = path.read_bytes()[:1000] + b"\xff" * 3000
    path.write_bytes(torn)
    operator.forget_answers()
    hive.start(node)
    operator.wait_until_whole()
    kept = [f for f in hive.journals.iterdir() if f.name.startswith(path.stem) and f != path]

    assert torn in [file.read_bytes() for file in kept]
    assert "could not read its journal and has moved it" in hive.log_of(node)
    assert node not in hive.ended()


def lose_disk_of(hive, *nodes):
    for node in nodes:
        for file in hive.journals.glob(f"{hive.journal_of(node).name}*"):
            file.unlink()


@pytest.fixture
def one_folder(hive):
    """The hive; what is started from now on has its journal in the same folder as the others."""
    before = rospy.get_param(f"{hive.blackboard}/journal")
    rospy.set_param(f"{hive.blackboard}/journal", str(hive.journals))
    yield hive
    rospy.set_param(f"{hive.blackboard}/journal", before)


def test_a_blackboard_node_without_its_disk_bootstraps_no_hive_beside_disks_of_robots(
    one_folder, operator
):
    hive, of_hive = one_folder, operator.last.hive
    hive.kill(*hive.members)
    lose_disk_of(hive, hive.blackboard)
    operator.forget_answers()
    hive.start(hive.blackboard)
    operator.demand(
        lambda: "heard no leader for 10 s; its journal is new" in hive.log_of(hive.blackboard),
        "the blackboard node still waits after 10 s, and says why",
    )
    hive.restart_ended()
    operator.wait_until_whole()

    assert operator.last.hive == of_hive
    assert operator.post(make_task("one-hive", (3.0, 2.0))).state == TaskState.WAITING
    assert operator.follow("one-hive") == TaskState.DONE


def test_a_hive_whose_majority_is_gone_goes_on_with_the_member_that_a_person_names(
    one_folder, operator
):
    hive, of_hive = one_folder, operator.last.hive
    left = hive.node_of("robot1")
    for drive in hive.drives:
        drive.seconds = 600.0
    operator.post(make_task("kept", (4.0, 2.0)))
    operator.demand(
        lambda: (
            left == operator.last.active or operator.acknowledged[left] == operator.last.version
        ),
        f"{left} has the task on its disk",
    )
    recover = ["recover", "--force-members", "robot1", "--journal", str(hive.journals)]
    refused = run_hive(*recover)
    hive.kill(*hive.members)
    lose_disk_of(hive, *(node for node in hive.members if node != left))
    for drive in hive.drives:
        drive.cancel_all()
        drive.seconds = 0.1
    recovered = run_hive(*recover)
    operator.forget_answers()
    hive.start(left)
    operator.demand(lambda: operator.last.hive != of_hive, f"{left} leads another hive")
    hive.restart_ended()
    operator.wait_until_whole()

    assert refused.returncode == BAD_INPUT
    assert "a member has it open; end all members first" in refused.stderr
    assert recovered.returncode == 0, recovered.stderr
    assert operator.last.hive.startswith(f"{of_hive}.")
    assert operator.follow("kept") == TaskState.DONE
    assert operator.post(make_task("recovered", (4.0, 3.0))).state == TaskState.WAITING
    assert operator.follow("recovered") == TaskState.DONE
