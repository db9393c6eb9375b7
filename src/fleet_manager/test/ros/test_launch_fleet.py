# SPDX-License-Identifier: BSD-3-Clause
import pytest

pytest.importorskip("roslaunch", reason="needs ROS")

from fleet_manager.ros.launch_fleet import launch_fleet

ZONE = "zones: [{name: door, kind: keep-out, corners: [[1, 1], [2, 1], [2, 2]]}]"
ROBOTS = "robots: [{name: robot1, model: mir100, pose: [5.0, 5.0, 0.0]}]"


@pytest.fixture
def check(tmp_path, capsys):
    """Check a fleet file with some lines; return what was said beside the launch file."""

    def call(*lines, **options):
        (tmp_path / "fleet.yaml").write_text("\n".join([*lines, ROBOTS]))
        words = [f"--{name}={value}" for name, value in options.items()]
        words += ["--check", str(tmp_path / "fleet.yaml")]
        launch_fleet.main(words, standalone_mode=False)
        return capsys.readouterr().err

    return call


def test_zones_that_bind_nobody_are_told_with_the_remedy(check):
    said = check(ZONE)

    assert said.count("\n") == 1
    assert "the fleet's zones bind nobody: start with traffic:=planned" in said


@pytest.mark.parametrize(
    ("lines", "options"),
    [([ZONE, "traffic: planned"], {}), ([ZONE], {"traffic": "planned"}), ([], {})],
)
def test_nothing_is_said_where_zones_bind_or_there_are_none(check, lines, options):
    assert check(*lines, **options) == ""
