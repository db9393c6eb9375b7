# SPDX-License-Identifier: BSD-3-Clause
"""An experiment runs as a whole system on ROS, also while processes stand still and die."""

import json
import os
import subprocess

import pytest
import yaml

from hive_common.resources import package_folder
from hive_lab.runner.limits import CASE

pytest.importorskip("blackboard.msg", reason="needs ROS and a built workspace")

EXPERIMENT = """\
fleet: lab
scenario: ./smoke.yaml
run_on: simulator
faults: [{after: 3, freeze: robot2, seconds: 2}, {after: 5, kill: blackboard}]
"""


def test_an_experiment_on_ros_goes_on_when_the_blackboard_is_killed(tmp_path):
    smoke = package_folder("fleet_manager") / "scenarios" / "smoke.yaml"
    # While robots wait for the next leader, simulated time goes on: on a busy machine it passes
    # the limit of the scenario, which is 40 s on the wall.
    content = yaml.safe_load(smoke.read_text(encoding="utf-8")) | {"time_limit": 20 * CASE}
    (tmp_path / "smoke.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    file = tmp_path / "killed.yaml"
    file.write_text(EXPERIMENT, encoding="utf-8")
    command = ["rosrun", "hive_lab", "compare", str(file), "--results", str(tmp_path / "out")]
    environment = {name: each for name, each in os.environ.items() if name != "ROS_MASTER_URI"}

    run = subprocess.run(
        command, env=environment, capture_output=True, text=True, check=False, timeout=CASE
    )

    assert run.returncode == 0, run.stderr
    (folder,) = (tmp_path / "out").iterdir()
    kept = json.loads((folder / "runs.json").read_text(encoding="utf-8"))
    (report,) = kept["reports"]["planned, latency"]
    assert report["all_done"], (report["remarks"], report["tasks"])
    assert report["collisions"] == 0
    assert "process has died" in "".join(
        log.read_text(errors="replace") for log in folder.rglob("fleet_manager.log")
    )
