# SPDX-License-Identifier: BSD-3-Clause
import pytest
import yaml

from hive_common.errors import MapError
from hive_common.map_file import load_map
from hive_common.pose import Pose
from hive_common.resources import package_folder
from simenv.ros.rviz_node import fitted

HIVE = (package_folder("simenv") / "rviz/hive.rviz").read_text()


def parts(config):
    content = yaml.safe_load(config)
    return content["Visualization Manager"]["Views"]["Current"], content["Window Geometry"]


@pytest.mark.parametrize("size", [(20.0, 12.0), (60.0, 40.0), (5.0, 100.0)])
def test_the_whole_map_fits_into_the_window(size):
    view, window = parts(fitted(HIVE, Pose(-3.0, 7.0, 0.0), size))

    assert size[0] * view["Scale"] < window["Width"]
    assert size[1] * view["Scale"] < window["Height"]
    assert (view["X"], view["Y"]) == (-3.0 + size[0] / 2, 7.0 + size[1] / 2)


def test_nothing_else_is_changed():
    before, after = yaml.safe_load(HIVE), yaml.safe_load(fitted(HIVE, Pose(0, 0, 0), (60, 40)))

    for content in (before, after):
        del content["Visualization Manager"]["Views"]
    assert before == after


def test_the_configuration_shows_the_whole_lab_as_it_is():
    grid = load_map("lab")
    height, width = grid.cells.shape
    size = (width * grid.resolution, height * grid.resolution)

    as_it_is, _ = parts(HIVE)
    fitted_to_the_lab, _ = parts(fitted(HIVE, grid.origin, size))

    assert as_it_is["Scale"] <= fitted_to_the_lab["Scale"]
    assert (as_it_is["X"], as_it_is["Y"]) == (fitted_to_the_lab["X"], fitted_to_the_lab["Y"])


@pytest.mark.parametrize("config", ["", "Panels: []", "Window Geometry: {Width: 3, Height: 4}"])
def test_a_configuration_without_view_is_refused(config):
    with pytest.raises(MapError, match=r"take hive\.rviz"):
        fitted(config, Pose(0, 0, 0), (20.0, 12.0))


def test_a_map_without_size_is_refused():
    with pytest.raises(MapError, match="must have a size"):
        fitted(HIVE, Pose(0, 0, 0), (0.0, 12.0))
