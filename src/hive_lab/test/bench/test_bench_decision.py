# SPDX-License-Identifier: BSD-3-Clause
"""The picture of `./hive bench decision`."""

import json

import PIL.Image

from hive_lab.live.decision_picture import _line, draw

FIGURES = {
    f"{way}_{robots}_{decision}_{what}": robots * 0.001
    for way, numbers in (("straight", (10, 2, 100)), ("map", (2, 5)))
    for robots in numbers
    for decision in ("distributed", "centralized")
    for what in ("bytes", "blackboard", "robot", "all")
}


def test_a_line_has_its_points_in_the_order_of_the_number_of_robots():
    assert _line(FIGURES, "straight", "distributed", "all") == ([2, 10, 100], [0.002, 0.01, 0.1])


def test_the_picture_is_drawn_from_the_file_that_the_benchmark_writes(tmp_path):
    source, target = tmp_path / "decision.json", tmp_path / "decision.png"
    source.write_text(json.dumps({"figures": FIGURES}))
    draw(json.loads(source.read_text())["figures"], target)

    with PIL.Image.open(target) as image:
        assert image.width > 1000
