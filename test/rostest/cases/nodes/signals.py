# SPDX-License-Identifier: BSD-3-Clause
"""Ctrl-C ends a node, whatever it is doing."""

import sys
from pathlib import Path

import pytest
import rosgraph
from launching import Launches

from hive_lab.runner.limits import PATIENCE

INTERRUPTED = Path(__file__).resolve().parents[2] / "nodes" / "interrupted_blackboard"


@pytest.fixture
def launches():
    launches = Launches()
    yield launches
    launches.stop()


def test_a_node_that_is_interrupted_while_it_holds_a_lock_ends_and_tells_the_master(
    launches, tmp_path
):
    given = (f"_journal:={tmp_path}", "_distance:=euclidean")
    ended = launches.run(sys.executable, str(INTERRUPTED), *given).wait(PATIENCE)

    assert ended == 0
    topics = dict(rosgraph.Master("/operator").getSystemState()[0])
    assert "/blackboard" not in topics.get("/bb_sync", [])
