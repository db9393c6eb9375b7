# SPDX-License-Identifier: BSD-3-Clause
"""A short experiment of two robots, in a user's own files."""

import pytest

FLEET = """\
robots:
  - {name: robot1, model: mir100, pose: [2.6, 2.0, 0.0]}
  - {name: robot2, model: ld60, pose: [2.6, 4.0, 0.0]}
"""
SCENARIO = """\
description: Two short ways.
world: lab
fleet: ./fleet.yaml
tasks:
  - {id: A, type: GA, goals: [[4.0, 2.2]]}
  - {id: B, type: GA, goals: [[4.0, 4.2]], after: 2}
"""
FILES = """\
fleet: ./fleet.yaml
scenario: ./scenario.yaml
cost_models: [latency]
"""


@pytest.fixture
def write_experiment(tmp_path):
    """Return a function that writes an experiment with more keys and more tasks; its path."""

    def write(more, tasks=""):
        (tmp_path / "fleet.yaml").write_text(FLEET, encoding="utf-8")
        (tmp_path / "scenario.yaml").write_text(SCENARIO + tasks, encoding="utf-8")
        path = tmp_path / "mine.yaml"
        path.write_text(FILES + more, encoding="utf-8")
        return path

    return write
