# SPDX-License-Identifier: BSD-3-Clause
"""The files that come with packages are found in a source tree and in an installation."""

import shutil

import pytest

from hive_common import resources
from hive_common.errors import FileError
from hive_common.resources import find_file, node_file, package_folder


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """An installation that holds a package with one node, and this module."""
    library = tmp_path / "lib/python3/dist-packages/hive_common"
    for folder in (
        library,
        tmp_path / "share/hive_navigation",
        tmp_path / "lib/hive_navigation",
    ):
        folder.mkdir(parents=True)
    (tmp_path / "share/hive_navigation/package.xml").touch()
    (tmp_path / "lib/hive_navigation/traffic_planner").touch()
    copy = library / "resources.py"
    shutil.copy(resources.__file__, copy)
    monkeypatch.setattr(resources, "__file__", str(copy))
    return tmp_path


def test_a_node_is_found_in_the_source_tree():
    file = node_file("blackboard", "robot_node")

    assert file == package_folder("blackboard") / "nodes/robot_node"
    assert file.is_file()


def test_a_node_is_found_where_it_is_installed(installed):
    found = node_file("hive_navigation", "traffic_planner")

    assert found == installed / "lib/hive_navigation/traffic_planner"


@pytest.mark.parametrize("package", ["blackboard", "nowhere"])
def test_a_node_that_is_not_there_is_said_with_the_remedy(package):
    with pytest.raises(FileError, match=r"source devel/setup\.bash first"):
        node_file(package, "no_node")


def test_a_name_that_is_too_long_for_a_file_is_not_known():
    with pytest.raises(FileError, match=r"robot model 'x{80}': not known"):
        find_file("robot_description", "models", "x" * 5000)
