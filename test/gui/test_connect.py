# SPDX-License-Identifier: BSD-3-Clause
"""Windows on a hive over Zenoh: their arguments, and what they say of the connection."""

import subprocess
import sys

import pytest

from fleet_manager.desk.facts import LinkChange, LinkState
from fleet_manager.gui.banner import banner_text
from fleet_manager.gui.desk import Desk
from hive_lab.runner.limits import PATIENCE

HERE = "tcp/127.0.0.1:7447"
MASTER = "http://localhost:11311"
NO_HIVE = "⚠ No {} at {}. Start the hive; this window connects."

PROGRAM = "from fleet_manager.gui.program import main; main('fleet_manager')"


@pytest.fixture
def said(person, link):
    """Return what the banner says after a link has told of its connection."""

    def say(change, *, to_leader):
        link.drain = lambda _limit: link.said and [link.said.pop(0)]
        desk = Desk(link)
        link.said.append(change)
        desk.start()
        person.wait_until(lambda: desk.link_change == change)
        if to_leader:
            del link.drain
            person.wait_until(lambda: desk.hive.heartbeat is not None)
        desk.stop()
        return banner_text(desk)

    return say


@pytest.mark.parametrize(("what", "where"), [("hive", HERE), ("ROS master", MASTER)])
def test_a_window_that_has_met_nobody_says_what_it_looks_for(said, what, where):
    change = LinkChange(LinkState.SEARCHING, where, what)

    assert said(change, to_leader=False) == NO_HIVE.format(what, where)


@pytest.mark.parametrize(
    ("what", "where", "then"),
    [("hive", HERE, "this window connects again"), ("ROS master", MASTER, "running nodes go on")],
)
def test_a_window_says_that_nobody_answers_any_more_and_what_that_means(said, what, where, then):
    change = LinkChange(LinkState.LOST, where, what)

    assert said(change, to_leader=True).endswith(
        f"⚠ The {what} at {where} does not answer; {then}."
    )


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["--map", "lab"], "--certificates and --map need --connect"),
        (["--connect", "lab"], "has transport: ros; allowed: zenoh"),
        (["--connect", "tcp/127.0.0.1:99999"], "allowed without certificates"),
        (["--connect", "tls/127.0.0.1:1", "--certificates", "/no/such"], "copy the whole folder"),
    ],
)
def test_a_window_that_cannot_know_its_hive_ends_with_a_line_that_says_why(
    screen,  # noqa: ARG001  (the program needs one)
    words,
    problem,
):
    ended = subprocess.run(
        [sys.executable, "-c", PROGRAM, *words],
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
    )

    assert ended.returncode == 2
    assert problem in ended.stderr.splitlines()[-1]
