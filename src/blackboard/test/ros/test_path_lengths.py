# SPDX-License-Identifier: BSD-3-Clause
"""Path lengths of a member without a map."""

import pytest

pytest.importorskip("blackboard.msg", reason="needs generated messages")

from blackboard.domain.settings import PathSettings
from blackboard.ros.path_lengths import RosPathLengths


def test_without_a_map_robots_of_all_radii_share_their_lengths_so_that_a_plan_computes_them_once():
    lengths = RosPathLengths(None, "/", PathSettings(distance="euclidean"))

    assert lengths.of(0.3) is lengths.of(0.5)
