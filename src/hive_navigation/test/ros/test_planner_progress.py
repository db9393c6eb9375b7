# SPDX-License-Identifier: BSD-3-Clause
"""How a traffic planner that is being loaded tells how far it is."""

import os

import pytest

from hive_navigation.ros import planner_progress
from hive_navigation.ros.planner_progress import OPTION, PERIOD, ProgressTeller


class Pipe:
    """A pipe, the teller at one end, and a clock."""

    def __init__(self, monkeypatch):
        self.time = 100.0
        monkeypatch.setattr(planner_progress.time, "monotonic", lambda: self.time)
        self.out, self.end = os.pipe()
        os.set_blocking(self.out, False)
        self.teller = ProgressTeller(["__name:=x", f"{OPTION}{self.end}"])

    def read(self):
        try:
            return os.read(self.out, 65536).decode().splitlines()
        except BlockingIOError:
            return []


@pytest.fixture
def pipe(monkeypatch):
    made = Pipe(monkeypatch)
    yield made
    for end in (made.out, made.end):
        os.close(end)


def test_every_step_is_told_and_a_step_that_goes_on_once_a_second(pipe):
    pipe.teller.say("makes the roadmap")
    pipe.teller.go_on("makes the roadmap")
    pipe.time += PERIOD
    pipe.teller.go_on("makes the roadmap")
    pipe.teller.go_on("makes the roadmap")
    pipe.teller.say("makes its first plan")

    assert pipe.read() == ["makes the roadmap", "makes the roadmap", "makes its first plan"]


def test_a_step_with_a_count_tells_what_it_begins(pipe):
    with pipe.teller.counting("loads modules", lambda: 7):
        pass

    assert pipe.read() == ["loads modules"]


def test_a_pipe_that_nobody_empties_holds_nobody_up(pipe):
    for _ in range(10_000):
        pipe.teller.say("makes the roadmap, step by step")

    assert len(pipe.read()) > 0


@pytest.mark.parametrize("words", [[], [OPTION], [f"{OPTION}x"]])
def test_without_a_pipe_nobody_is_told(words):
    ProgressTeller(words).say("waits for the map")
