#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes generated pictures and pages anew.

    python3 setup/pages.py                   # list them
    python3 setup/pages.py mapping day       # make these anew
    python3 setup/pages.py --without-ros     # make all anew that start no ROS master

What is made by measuring differs from run to run: look at it before you commit it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
WITHOUT_ROS = "--without-ros"


@dataclass(frozen=True)
class Made:
    """Files that are made together.

    Attributes:
        files: Their paths.
        commands: For bash at the root of the repository; `$new` is an empty folder.
        minutes: About how long it takes on two cores.
        ros: Whether it starts a ROS master and nodes, which want a machine for themselves.
    """

    files: tuple[str, ...]
    commands: str
    minutes: float
    ros: bool = False


PAGES = {
    "allocation": Made(
        ("src/hive_lab/resource/allocation_reference.json",), "setup/reference/make", 30.0
    ),
    "architectures": Made(
        ("docs/images/architectures.png", "docs/images/architectures_faults.png"),
        './hive bench architectures --resume "$new/runs.jsonl"\n'
        './hive shell -c "python3 -m hive_lab.bench.architectures.picture '
        "'$new/runs.jsonl' docs/images\"",
        10.0,
    ),
    "comparing": Made(
        ("docs/images/benchmarks.png", "docs/images/benchmarks_pictures.png"),
        './hive shell -c "python3 -m hive_lab.windows.comparing_pictures docs/images"',
        1.0,
    ),
    "day": Made(
        ("docs/images/day.png",),
        '(cd "$new" && "$OLDPWD/hive" bench day); cp "$new/day.png" docs/images/day.png',
        2.0,
    ),
    "decision": Made(
        ("docs/images/decision.png",),
        './hive bench decision --json "$new/decision.json"\n'
        './hive shell -c "python3 -m hive_lab.live.decision_picture '
        "'$new/decision.json' docs/images/decision.png\"",
        1.0,
    ),
    "demo": Made(
        ("docs/images/demo.png",),
        './hive demo --headless --results "$new"\ncp "$new"/*/picture.png docs/images/demo.png',
        4.0,
        ros=True,
    ),
    "imports": Made(
        ("docs/architecture.md",), '.venv/bin/python3 "test/unit/test_architecture.py"', 0.1
    ),
    "interfaces": Made(
        ("test/rostest/interfaces.yaml",),
        "HIVE_RECORD_INTERFACES=1 "
        "./hive test test/unit/test_interfaces.py test/rostest/interfaces.test",
        5.0,
        ros=True,
    ),
    "mapping": Made(
        ("docs/images/mapping.png",),
        './hive shell -c "python3 -m hive_lab.bench.mapping docs/images/mapping.png"',
        2.0,
    ),
    "maps": Made(
        ("maps/lab.pgm", "maps/lab.yaml", "maps/warehouse.pgm", "maps/warehouse.yaml"),
        "for name in lab warehouse; do\n"
        '  ./hive shell -c "rosrun simenv draw_map $name maps/$name"\n'
        "done",
        0.1,
    ),
    "parameters": Made(
        (
            "docs/protocol.md",
            "src/blackboard/config/blackboard.yaml",
            "src/blackboard/config/robot.yaml",
        ),
        ".venv/bin/python3 setup/write_parameters.py",
        0.1,
    ),
    "scale": Made(
        ("docs/images/scale.png",),
        './hive bench scale --json "$new/scale.json"\n'
        './hive shell -c "python3 -m hive_lab.bench.scale.picture '
        "'$new/scale.json' docs/images/scale.png\"",
        70.0,
    ),
    "test-plan": Made(
        ("docs/test-plan.md",),
        "./hive test test/rostest/plan_start.test test/rostest/plan_tasks.test "
        'test/rostest/plan_robots.test test/rostest/plan_failover.test --results "$new"\n'
        "./hive shell -c \"python3 test/rostest/try_breaks.py '$new/breaks.json'\"\n"
        "./hive shell -c \"python3 test/rostest/plan_page.py '$new' '$new/breaks.json'\"",
        30.0,
        ros=True,
    ),
    "windows": Made(
        tuple(
            f"docs/images/{name}.png"
            for name in (
                "fleet_manager",
                "fleet_manager_dark",
                "map",
                "rviz",
                "takeover",
                "task_details",
                "task_entry_mistakes",
            )
        ),
        './hive shell -c "python3 -m hive_lab.windows.pictures docs/images"',
        3.0,
        ros=True,
    ),
}
"""What is made, by the word that makes it."""


def listed() -> str:
    """Return the list of what can be made."""
    lines = ["usage: python3 setup/pages.py NAME ... or --without-ros; there are:", ""]
    for name, made in PAGES.items():
        how = f"about {max(1, round(made.minutes))} min{', starts ROS' if made.ros else ''}"
        lines += [f"  {name:12}{how}", *(f"              {file}" for file in made.files)]
    return "\n".join(lines) + "\n"


def make(name: str) -> int:
    """Make the files of a word anew; return the exit code of the commands."""
    with tempfile.TemporaryDirectory(prefix="robo-hive-pages-") as new:
        return subprocess.run(  # noqa: S603  (the commands above)
            ["bash", "-euo", "pipefail", "-c", PAGES[name].commands],  # noqa: S607  (on the path)
            cwd=ROOT,
            env=os.environ | {"new": new},
            check=False,
        ).returncode


def main(words: list[str]) -> int:
    """Make what the words name; return the exit code."""
    if not words:
        sys.stdout.write(listed())
        return 0
    if words == [WITHOUT_ROS]:
        words = [name for name, made in PAGES.items() if not made.ros]
    if unknown := [word for word in words if word not in PAGES]:
        sys.stderr.write(f"pages: {unknown[0]!r} is unknown; allowed: {', '.join(PAGES)}\n")
        return 2
    for name in words:
        sys.stdout.write(f"pages: {name}, about {max(1, round(PAGES[name].minutes))} min\n")
        sys.stdout.flush()
        if code := make(name):
            sys.stderr.write(f"pages: {name} could not be made; see above\n")
            return code
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
