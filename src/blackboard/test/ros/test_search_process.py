# SPDX-License-Identifier: BSD-3-Clause
"""The process beside the leader that searches for plans: real processes, no ROS."""

import os
import pickle
import queue
import subprocess
import sys

import numpy as np
import pytest

from blackboard.auction.search import worker
from blackboard.auction.search.fields import fields
from blackboard.auction.search.problem import Problem
from blackboard.auction.search.ruin_recreate import search
from blackboard.auction.search.searcher import Job
from blackboard.domain.path_lengths import FieldJob, Moves
from blackboard.ros.search_process import SearchProcess


@pytest.fixture(autouse=True)
def modules(monkeypatch):
    """Let the processes find the modules that this one has found, wherever it did."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))


class Desk:
    """A talker's thread: what is called there waits until it is taken."""

    def __init__(self):
        self.calls, self.warnings = queue.Queue(), []

    def call(self, action):
        self.calls.put(action)

    def warn(self, text):
        self.warnings.append(text)

    def take(self):
        self.calls.get(timeout=60.0)()


def job(seed=1, rounds=800):
    """Return a search for who of two robots does which of four tasks on a road."""
    places, robots = np.array([0.0, 9.0, 1.0, 8.0]), np.array([0.0, 10.0])
    legs = np.zeros((1, 7, 5))
    legs[0, :4, :4] = np.abs(places[:, None] - places)
    legs[0, 5:, :4] = np.abs(robots[:, None] - places)
    problem = Problem(
        np.zeros(2, dtype=int),
        legs,
        legs,
        np.zeros((1, 5)),
        np.zeros((1, 5)),
        np.zeros(2),
        np.full(2, np.inf),
        np.ones(4),
        np.zeros(4, dtype=int),
        np.ones((2, 4), dtype=bool),
    )
    return Job(problem, ((), ()), "waiting", 5.0, seed, rounds, np.inf, np.inf)


def road(nodes, factor=1.0):
    """Return a job for the fields of both ends of a road, whose moves cost as much farther."""
    ends = np.repeat(np.arange(nodes), 2)[1:-1]
    starts = ends + np.where(np.arange(len(ends)) % 2, -1, 1)
    first = np.searchsorted(ends, np.arange(nodes + 1))
    lengths = np.full(len(ends), 0.5)
    costs = lengths if factor == 1.0 else factor * lengths
    moves = Moves(first.astype(np.int32), starts.astype(np.int32), costs, lengths)
    return FieldJob(moves, [0, nodes - 1])


@pytest.fixture
def desk():
    return Desk()


@pytest.fixture
def searcher(desk):
    searcher = SearchProcess(desk)
    yield searcher
    searcher.close()


def test_it_finds_what_a_search_in_this_process_finds(desk, searcher):
    results = []
    searcher.start()
    for seed in (1, 2):
        searcher.search(job(seed), results.append)
        desk.take()

    assert [each.plan for each in results] == [search(job(1)).plan, search(job(2)).plan]
    assert results[0].plan == ((0, 2), (1, 3))
    assert results[0].offers.eta.tolist() == search(job(1)).offers.eta.tolist()


@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_it_computes_fields_between_two_searches(desk, searcher, factor):
    results = []
    wanted = road(300_000, factor)
    searcher.search(job(), results.append)
    desk.take()
    searcher.fields(wanted, results.append)
    desk.take()
    searcher.search(job(), results.append)
    desk.take()

    assert results[0].plan == results[2].plan == search(job()).plan
    for (lengths, lost), (own, own_lost) in zip(results[1], fields(wanted), strict=True):
        np.testing.assert_array_equal(lengths, own)
        np.testing.assert_array_equal(lost, own_lost)
    assert results[1][0][0][-1] == results[1][1][0][0] == 0.5 * 299_999
    if factor > 1.0:
        assert results[1][0][1][-1] == pytest.approx(2 * 0.5 * 299_999)


def test_fields_whose_process_was_killed_do_not_come_and_the_next_ones_do(desk, searcher):
    results = []
    searcher.start()
    searcher.fields(road(3_000_000), results.append)
    searcher.process.kill()
    searcher.process.wait()
    desk.take()
    searcher.fields(road(3), results.append)
    desk.take()

    assert results[0] is None
    assert [lengths.tolist() for lengths, _ in results[1]] == [[0.0, 0.5, 1.0], [1.0, 0.5, 0.0]]


def test_what_was_dropped_is_never_told(desk, searcher):
    results = []
    searcher.search(job(), results.append)
    searcher.drop()
    desk.take()
    searcher.search(job(2), lambda found: results.append(("second", found)))
    desk.take()

    assert [(name, found.plan) for name, found in results] == [("second", search(job(2)).plan)]


def test_a_search_whose_process_was_killed_has_failed_and_the_next_one_works(desk, searcher):
    results = []
    searcher.start()
    searcher.process.kill()
    searcher.process.wait()
    searcher.search(job(), results.append)
    desk.take()
    assert [each.plan for each in results] == [search(job()).plan]

    searcher.search(job(rounds=10**12), results.append)
    searcher.process.kill()
    desk.take()
    assert results[1] is None


def test_a_member_that_no_longer_leads_keeps_no_process(searcher):
    searcher.start()
    process = searcher.process
    searcher.stop()

    searcher.close()
    assert process.returncode != 0
    assert searcher.process is None


def test_it_ends_when_whoever_started_it_has_ended(searcher):
    searcher.start()
    searcher.process.stdin.close()

    assert searcher.process.wait(timeout=60.0) == 0


def test_one_that_was_closed_with_its_program_starts_nothing_more(desk, searcher):
    searcher.close()
    searcher.start()
    searcher.search(job(), desk.warnings.append)

    assert searcher.process is None
    assert desk.calls.empty()


def test_a_process_whose_starter_was_killed_during_a_search_ends_without_a_word():
    command = [sys.executable, "-m", "blackboard.auction.search.worker"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, **pipes) as worker:
        worker.stdout.close()
        worker.stdin.write(pickle.dumps(job()))
        worker.stdin.close()

        assert worker.stderr.read() == b""
        assert worker.wait(timeout=60.0) == 0


def test_an_answer_is_written_to_its_end_however_often_the_pipe_takes_a_part(monkeypatch):
    written = []

    def write(_, data):
        written.append(bytes(data[:3]))
        return len(written[-1])

    monkeypatch.setattr(worker.os, "write", write)
    worker._tell(b"the answer")  # noqa: SLF001

    assert written == [b"the", b" an", b"swe", b"r"]


def test_a_process_whose_answer_makes_no_sense_is_ended_and_replaced(desk, searcher):
    confused = searcher.process = subprocess.Popen(
        ["sh", "-c", "echo nonsense; exec cat > /dev/null"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    results = []
    for _ in range(2):
        searcher.search(job(), results.append)
        desk.take()

    assert results[0] is None
    assert confused.returncode is not None
    assert results[1].plan == search(job()).plan
