# SPDX-License-Identifier: BSD-3-Clause
"""What the process of a traffic planner shows of its progress, and what was heard of one last."""

import pytest

pytest.importorskip("robot_description.msg")

import rospy
from robot_description.msg import TrafficState

from blackboard.ros import planner_process
from blackboard.ros.planner_process import LastWord, PlannerProcess

SAYS = """
import os, sys
pipe = int(next(word for word in sys.argv if word.startswith("--progress=")).split("=")[1])
os.write(pipe, b"loads\\nwaits for the map\\nwai")
{more}
"""


@pytest.fixture
def start(tmp_path, monkeypatch):
    """Start a program as the planner; return it when it has said all and waits for its end."""
    started = []

    def start(more=""):
        file = tmp_path / "planner"
        file.write_text(SAYS.format(more=more))
        monkeypatch.setattr(planner_process, "node_file", lambda *_: str(file))
        started.append(PlannerProcess("/", []))
        return started[-1]

    yield start
    for each in started:
        each.end()
        each.kill()
        wait_for_end(each)


def wait_for_end(process):
    while not process.ended():
        pass


def progress_at_the_end(process):
    wait_for_end(process)
    return process.progress()


def test_whole_lines_count_as_steps_and_the_last_one_is_what_it_does(start):
    steps, doing, _ = progress_at_the_end(start())

    assert (steps, doing) == (2, "waits for the map")


def test_a_process_that_has_said_nothing_new_stays_where_it_was(start):
    process = start()
    before = progress_at_the_end(process)

    assert process.progress()[:2] == before[:2]


def test_the_work_of_the_main_thread_is_seen_while_it_runs(start):
    process = start(
        "while sum(os.times()[:2]) < 0.05: pass\nos.write(pipe, b'ts\\n')\nsys.stdin.read()"
    )
    while (seen := process.progress()).steps < 3:
        pass

    assert seen.worked >= 0.04
    assert seen.doing == "waits"


@pytest.mark.parametrize(
    ("more", "how"),
    [
        ("", "by itself, as it does when the map or the clock is another one"),
        ("sys.exit(1)", "exit code 1"),
        ("os.kill(os.getpid(), 9)", "signal 9"),
    ],
)
def test_how_it_has_ended_is_told_in_words(start, more, how):
    process = start(more)
    wait_for_end(process)

    assert process.ended() == how


@pytest.fixture
def last(monkeypatch):
    """The last word of planners at 7 s, and `hear` for one more; at first the door is closed."""
    heard = []
    monkeypatch.setattr(rospy, "Subscriber", lambda _name, _kind, hear, **_: heard.append(hear))
    word = LastWord("/lab/", ("door",), lambda: 7.0)
    (word.hear,) = heard
    return word


def told(epoch, *closed, stamp=1.5):
    """Return what somebody tells, whoever that is."""
    msg = TrafficState(epoch=epoch, closed=list(closed))
    msg.header.stamp = rospy.Time.from_sec(stamp)
    return msg


def test_what_the_newest_planner_tells_of_closed_zones_is_remembered(last):
    last.hear(told(2, "aisle"))
    last.hear(told(1, "yard"))

    assert (last.closed, last.at(2), last.at(1)) == (("aisle",), 7.0, float("-inf"))


def test_what_a_member_says_itself_counts_for_nothing_and_what_a_relay_brings_it_counts(last):
    last.note_own(rospy.Time.from_sec(1.5))

    last.hear(told(2, "aisle"))
    assert last.closed == ("door",)
    last.hear(told(2, "aisle", stamp=1.6))
    assert last.closed == ("aisle",)
