# SPDX-License-Identifier: BSD-3-Clause
"""The hive that benchmarks break: a blackboard node and four robots that drive nowhere."""

from __future__ import annotations

import contextlib
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import rospy

from hive_lab.live.fake_base import FakeBase
from hive_lab.live.live_hive import LiveHive, own_master
from hive_lab.live.live_operator import LiveOperator

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextlib.contextmanager
def bench_hive(node: str) -> Iterator[tuple[LiveHive, LiveOperator]]:
    """Run a hive on a ROS master of its own at the address of the environment.

    Args:
        node: What this process calls itself.
    """
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="robo-hive-bench-")))
        stack.enter_context(own_master(folder))
        rospy.init_node(node, anonymous=True, disable_signals=True)
        stack.callback(rospy.signal_shutdown, "what follows ends the master")
        hive = LiveHive(folder)
        stack.callback(hive.end)
        stand_ins = [FakeBase(f"/{name}", x=float(i)) for i, name in enumerate(hive.robots)]
        operator = LiveOperator(hive.namespace, hive.members)
        hive.start_all()
        yield hive, operator
        stand_ins.clear()
