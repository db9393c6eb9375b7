# SPDX-License-Identifier: BSD-3-Clause
"""The benchmark of a hive's size measures real hives, and tells how their cost grows."""

import json

import pytest
from PIL import Image

from hive_lab.bench.scale import measure, picture
from hive_lab.bench.scale.measure import DECISIONS, GROWING, SIZES, Cost, growth

COST = Cost(
    idle_messages=100.0,
    idle_bytes=1000.0,
    idle_heartbeats=800.0,
    idle_leader=0.001,
    messages=200.0,
    bytes=2000.0,
    heartbeats=1000.0,
    changes=500.0,
    leader=0.01,
    robot=0.001,
    all=0.1,
    load=0.1,
    not_assigned=0.0,
)


def keep(file, **changed):
    """Write a run of each kind, as `--resume` keeps them."""
    with file.open("w") as kept:
        for decision in DECISIONS:
            for size in SIZES:
                result = COST._replace(messages=float(size), bytes=float(size**2), **changed)
                run = {"run": f"{decision}, {size} robots", "result": result._asdict()}
                kept.write(json.dumps(run) + "\n")


def test_an_exponent_tells_how_a_figure_grows_with_the_robots_in_the_end():
    costs = {
        size: COST._replace(messages=7.0 * size, bytes=3.0 * size**2)._asdict()
        for size in (30, 100)
    }
    costs[10] = COST._asdict()

    found = growth(costs)

    assert set(found) == set(GROWING)
    assert found["messages"] == pytest.approx(1.0)
    assert found["bytes"] == pytest.approx(2.0)
    assert found["leader"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("changed", "broken", "met"),
    [({}, False, True), ({"not_assigned": 1.0}, True, False), ({"load": 1.2}, False, False)],
)
def test_a_task_that_no_robot_gets_breaks_a_promise_and_a_busy_leader_misses_an_aim(
    tmp_path, changed, broken, met
):
    file = tmp_path / "runs.jsonl"
    keep(file, **changed)

    result = measure.run(resume=file)

    assert result.broken is broken
    assert all(result.met.values()) is met
    assert result.figures["planned_growth_bytes"] == pytest.approx(2.0)


def test_of_one_size_no_growth_is_told(tmp_path):
    file = tmp_path / "runs.jsonl"
    keep(file)

    result = measure.run(robots=10, resume=file)

    assert result.figures["10_robots_planned_messages"] == 10.0
    assert not [name for name in result.figures if "growth" in name]


def test_a_picture_shows_all_sizes(tmp_path):
    file, drawn = tmp_path / "runs.jsonl", tmp_path / "scale.png"
    keep(file)

    picture.draw(measure.run(resume=file).figures, drawn)

    with Image.open(drawn) as image:
        assert image.width > 1000


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_small_hive_is_measured_at_work():
    cost = Cost(**measure.measure("distributed", 4))

    assert cost.not_assigned == 0.0
    assert 0.0 < cost.idle_messages < cost.messages
    assert 0.5 * cost.idle_bytes < cost.idle_heartbeats < cost.idle_bytes
    assert 0.0 < cost.changes < cost.heartbeats < cost.bytes - cost.changes
    assert 0.0 < cost.robot < cost.leader < cost.all
    assert cost.load < 0.5
