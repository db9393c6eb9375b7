# SPDX-License-Identifier: BSD-3-Clause
"""The windows never keep a person waiting; how long they do at most is measured by `bench gui`.

By its name this is the first of the windows' tests: the others leave a hive running beside them.
"""

from __future__ import annotations

import itertools
from types import SimpleNamespace

import pytest

from blackboard.domain.record import TaskUpdate
from blackboard.domain.task import TaskState
from fleet_manager.client.reports import HiveMessage
from fleet_manager.gui import desk as desk_module
from fleet_manager.gui.desk import BATCH, BUDGET, Desk
from hive_lab.runner.limits import CASE
from hive_lab.windows import bench

SECONDS_PER_FACT = BUDGET / 50
"""What each fact takes by the clock of the test [s]."""
FLOOD = 5000


class FloodedLink:
    """A hive that has said a lot at once; whoever takes it in needs time for each fact."""

    def __init__(self):
        self.time = 0.0
        self.turns = [0]
        updates = (TaskUpdate(f"T{i}", TaskState.WAITING, epoch=1) for i in range(FLOOD))
        self._facts = (HiveMessage(update, 0.0) for update in updates)

    def start(self):
        pass

    def stop(self):
        pass

    def now(self):
        return self.time

    def drain(self, limit):
        facts = list(itertools.islice(self._facts, limit))
        self.time += len(facts) * SECONDS_PER_FACT
        self.turns[-1] += len(facts)
        return facts

    def send(self, command):
        pass


def test_a_flood_of_messages_is_taken_in_a_little_at_every_turn_of_the_event_loop(
    person, monkeypatch
):
    link = FloodedLink()
    monkeypatch.setattr(desk_module, "time", SimpleNamespace(monotonic=link.now))
    desk = Desk(link)
    desk.changed.connect(lambda _: link.turns.append(0))  # once for each turn
    desk.start()
    person.wait_until(lambda: sum(link.turns) == FLOOD)
    desk.stop()

    assert max(link.turns) * SECONDS_PER_FACT <= BUDGET + BATCH * SECONDS_PER_FACT
    assert len(link.turns) >= FLOOD * SECONDS_PER_FACT / BUDGET / 2


@pytest.mark.timeout(CASE)  # every case is watched for some seconds
def test_the_window_follows_a_large_hive_and_the_loss_of_it_and_its_stalls_are_measured(screen):  # noqa: ARG001
    figures = bench.run().figures

    assert set(bench.AIMS) <= set(figures)
