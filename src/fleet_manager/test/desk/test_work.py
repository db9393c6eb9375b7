# SPDX-License-Identifier: BSD-3-Clause
import threading

from fleet_manager.desk.work import Work

WITHIN = 20.0  # a busy machine needs no longer [s]


def test_actions_are_run_in_their_order_by_the_thread_that_has_time():
    work, done = Work(), []
    for number in range(3):
        work.put(lambda number=number: done.append((number, threading.current_thread().name)))
    work.run_for(0.0)

    assert done == [(number, threading.current_thread().name) for number in range(3)]


def test_what_is_added_meanwhile_is_run_too():
    work, done = Work(), []
    work.put(lambda: work.put(lambda: done.append("later")))
    work.run_for(0.0)

    assert done == ["later"]


def test_nobody_waits_for_work_once_it_is_stopped():
    work = Work()
    worker = threading.Thread(target=lambda: (work.run_for(WITHIN), work.pause(WITHIN)))
    worker.start()
    work.stop()
    worker.join(WITHIN / 2)

    assert not worker.is_alive()


def test_nothing_is_run_after_the_stop():
    work, done = Work(), []
    work.stop()
    work.put(lambda: done.append("late"))
    work.run_for(0.0)

    assert work.is_stopped
    assert done == []
