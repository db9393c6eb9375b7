# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

from blackboard.msg import TaskState

from hive_lab.live.soak import Growth, Posted, Size, added_up


class FakeProcesses:
    """Time that a test sets [s], and processes of the sizes that it gives them, by their ids."""

    def __init__(self):
        self.now = 0.0
        self.sizes = {}

    def measured(self):
        return Growth(lambda: self.now, self.sizes.__getitem__)


def test_a_process_that_grows_within_its_first_minute_counts_for_nothing():
    processes = FakeProcesses()
    growth = processes.measured()
    for processes.now, memory in ((0.0, 30.0), (59.0, 90.0), (60.0, 91.0), (120.0, 91.0)):
        processes.sizes[1] = Size(memory, 20.0, 40.0)
        growth.look([1])

    assert growth.worst == Size(0.0, 0.0, 0.0)


def test_a_process_that_grows_after_its_first_minute_counts_even_if_it_shrinks_again():
    processes = FakeProcesses()
    growth = processes.measured()
    for processes.now, grown in ((0.0, 0.0), (60.0, 0.0), (120.0, 7.0), (180.0, 1.0)):
        processes.sizes[1] = Size(90.0 + grown, 20.0 + grown, 40.0 + grown)
        growth.look([1])

    assert growth.worst == Size(7.0, 7.0, 7.0)


def test_a_restarted_process_is_another_one():
    processes = FakeProcesses()
    processes.sizes = {1: Size(90.0, 20.0, 40.0), 2: Size(120.0, 30.0, 60.0)}
    growth = processes.measured()
    for processes.now, pid in ((0.0, 1), (60.0, 1), (70.0, 2), (130.0, 2)):
        growth.look([pid])

    assert growth.worst == Size(0.0, 0.0, 0.0)


def test_journals_grow_from_the_size_that_they_had_first(tmp_path):
    journal, growth = tmp_path / "robot1.sqlite3", Growth()
    for size in (5_000, 8_000, 6_000):
        journal.write_bytes(b"x" * size)
        for other in ("robot1.sqlite3-wal", "robot1.auctions.sqlite3"):
            (tmp_path / other).write_bytes(b"x" * 3 * size)
        growth.look_at_journals(tmp_path)

    assert growth.of_journals == 3_000


def test_pieces_of_a_soak_add_up_and_the_largest_growth_counts():
    pieces = [
        {"minutes": 30, "tasks": 800.0, "tasks_not_done": 0.0, "memory_growth": 3.0},
        {"minutes": 10, "tasks": 280.0, "tasks_not_done": 1.0, "memory_growth": 1.5},
    ]

    assert added_up(pieces) == {
        "minutes": 40,
        "tasks": 1080.0,
        "tasks_not_done": 1.0,
        "memory_growth": 3.0,
    }


def test_a_soak_knows_the_ends_of_tasks_that_the_hive_has_forgotten_since():
    states = {"T1": TaskState.DONE, "T2": TaskState.FAILED, "T3": TaskState.STARTED}
    posted = Posted(lambda name: states.get(name, -1))
    for name in states:
        posted.add(name)
    before = posted.have_ended()
    states.clear()
    states["T3"] = TaskState.DONE

    assert not before
    assert posted.have_ended()
    assert (posted.total, posted.ended, posted.done) == (3, 3, 2)
