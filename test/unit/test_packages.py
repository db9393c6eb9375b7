# SPDX-License-Identifier: BSD-3-Clause
"""What must hold in every package: dependencies named, nodes small and installed, and so on."""

import ast
import os
import re
import shlex
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = sorted(path.parent for path in ROOT.glob("src/*/package.xml"))
LAUNCH_FILES = sorted(ROOT.glob("src/*/launch/*.launch"))
NODES = sorted(path for path in ROOT.glob("src/*/nodes/*") if path.is_file())

# Import name -> name in package.xml, where they differ.
DEPENDENCY = {
    "PIL": "python3-pil",
    "PyQt5": "python3-pyqt5",
    "_pytest": "python3-pytest",
    "attrs": "python3-attrs",
    "catkin_pkg": "python3-catkin-pkg",
    "cattrs": "python3-cattr",
    "click": "python3-click",
    "fastjsonschema": "python3-fastjsonschema",
    "matplotlib": "python3-matplotlib",
    "numba": "python3-numba",
    "numpy": "python3-numpy",
    "paho": "paho-mqtt",
    "psutil": "python3-psutil",
    "pytest": "python3-pytest",
    "rospkg": "python3-rospkg",
    "scipy": "python3-scipy",
    "shapely": "python3-shapely",
    "yaml": "python3-yaml",
    "zenoh": "eclipse-zenoh",
}

# Name in package.xml -> name of Debian's package, where they differ.
DEBIAN = {"python3-attrs": "python3-attr"}

# What rosdep resolves, by its data of August 2026: first the packages of ROS Noetic, then the keys
# that name a package of Debian 12 and 13 and of Ubuntu 22.04 and 24.04. All other names stand in a
# table of CONTRIBUTING.md.
ROSDEP = set(
    """
    actionlib actionlib_msgs catkin diagnostic_msgs genpy geometry_msgs message_filters
    message_generation message_runtime move_base_msgs nav_msgs python_qt_binding
    robot_state_publisher rosgraph rosgraph_msgs roslaunch rosmaster rospy rostest rviz sensor_msgs
    std_msgs std_srvs tf2_msgs tf2_ros visualization_msgs xacro

    mosquitto python3-attrs python3-click python3-fastjsonschema python3-matplotlib python3-numba
    python3-numpy python3-pil python3-psutil python3-pytest python3-rospkg
    python3-scipy python3-setuptools python3-shapely python3-yaml
    """.split()  # noqa: SIM905  (a list would have a line for each name)
)


def of(paths):
    """Name a case by package and file."""
    return {"argvalues": paths, "ids": [str(path.relative_to(ROOT / "src")) for path in paths]}


def xml(path):
    """Return the root of one of our own XML files."""
    return ET.parse(path).getroot()  # noqa: S314  (our own file)


def named_in_package_xml(package):
    """Return every name that package.xml depends on when the package runs."""
    tags = {"depend", "exec_depend"}
    return {tag.text for tag in xml(package / "package.xml") if tag.tag in tags}


def imports(paths):
    """Return the first names of what files import, the standard library's left out."""
    roots = set()
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                roots |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                roots.add(node.module.partition(".")[0])
    return roots - set(sys.stdlib_module_names)


def imported(package):
    """Return what the modules and nodes of a package import, as names for package.xml."""
    roots = imports([*package.glob("src/**/*.py"), *package.glob("nodes/*")])
    return {DEPENDENCY.get(root, root) for root in roots - {package.name}}


def launched(package):
    """Return the packages that the launch files of a package start nodes or read files from."""
    names = set()
    for path in package.glob("launch/*.launch"):
        names |= {node.get("pkg") for node in xml(path).iter("node")}
        names |= set(re.findall(r"\$\(find ([\w-]+)\)", path.read_text()))
    return {name for name in names if "$" not in name} - {package.name}


@pytest.mark.parametrize("package", **of(PACKAGES))
def test_package_xml_names_what_the_package_imports(package):
    assert imported(package) - named_in_package_xml(package) == set()


@pytest.mark.parametrize("package", **of(PACKAGES))
def test_package_xml_names_what_its_launch_files_start(package):
    assert launched(package) - named_in_package_xml(package) == set()


def test_the_table_of_what_rosdep_lacks_is_complete():
    files = [*ROOT.glob("src/*/package.xml"), ROOT / "test/rostest/package.xml"]
    named = {tag.text for file in files for tag in xml(file) if tag.tag.endswith("depend")}
    page = (ROOT / "CONTRIBUTING.md").read_text()
    table = page.partition("| name in `package.xml` |")[2].partition("\n\n")[0]
    lacking = re.findall(r"^\| `([^`]+)` \|", table, re.MULTILINE)

    assert named - {package.name for package in PACKAGES} - ROSDEP == set(lacking)
    assert ROSDEP - named == set(), "a name that no package has"


@pytest.mark.parametrize("folder", ["setup", "test"])
def test_a_build_tool_finds_packages_in_src_only(folder):
    find_package_paths = pytest.importorskip("catkin_pkg.packages").find_package_paths

    assert find_package_paths(ROOT / folder) == []


def test_setup_installs_everything_that_is_imported_anywhere():
    lists = [ROOT / "setup/apt-packages.txt", ROOT / "setup/pip-packages.txt"]
    installed = {
        line.partition("==")[0] for file in lists for line in file.read_text().splitlines()
    }
    ours = {package.name for package in PACKAGES}
    ours |= {path.stem for path in ROOT.glob("test/rostest/**/*.py")}  # in folders on the path
    files = [*ROOT.glob("src/**/*.py"), *ROOT.glob("test/**/*.py"), *NODES]
    wanted = {
        root: DEPENDENCY.get(root, f"python3-{root.replace('_', '-')}")
        for root in imports(files) - ours - installed
    }

    assert {name for name in wanted.values() if DEBIAN.get(name, name) not in installed} == set()


@pytest.mark.parametrize("package", **of(PACKAGES))
def test_a_package_tells_its_history(package):
    version = xml(package / "package.xml").findtext("version")
    history = (package / "CHANGELOG.rst").read_text()

    assert package.name in history.splitlines()[1]
    assert version in history or "Forthcoming" in history


@pytest.mark.parametrize("path", **of(LAUNCH_FILES))
def test_every_launch_argument_is_explained(path):
    parents = {child: parent for parent in xml(path).iter() for child in parent}
    arguments = [tag for tag in parents if tag.tag == "arg" and parents[tag].tag != "include"]
    for_users = [tag for tag in arguments if tag.get("value") is None]
    unexplained = [tag.get("name") for tag in for_users if not tag.get("doc")]

    assert unexplained == []


@pytest.mark.parametrize("path", **of(LAUNCH_FILES))
def test_an_argument_in_a_command_is_quoted_because_it_may_have_spaces(path):
    words = [
        word
        for tag in xml(path).iter()
        for key in ("command", "args")
        for word in shlex.split(re.sub(r"\$\([^)]*\)", _with_a_space, tag.get(key, "")))
    ]

    assert [word for word in words if word in {"arg-a", "b"}] == []


STOCK = "$(arg is_stock)"
"""Of what counts only for a robot with a ROS master of its own, whose nodes have no namespace."""


@pytest.mark.parametrize("path", **of(LAUNCH_FILES))
def test_a_launch_file_names_nothing_absolutely_so_that_a_hive_may_run_in_a_namespace(path):
    tags = [tag for tag in xml(path).iter() if tag.get("if") != STOCK]
    names = {tag.get(key, "") for tag in tags for key in ("name", "param", "ns", "to")}

    assert {name for name in names if name.startswith("/")} <= {"/use_sim_time"}


def _with_a_space(substitution):
    """Return a value for a substitution: a user's argument has a space, a package's path none."""
    return "arg-a b" if substitution[0].startswith("$(arg") else "path"


@pytest.mark.parametrize("path", **of(LAUNCH_FILES))
def test_every_node_of_ours_that_is_launched_is_there(path):
    ours = {package.name for package in PACKAGES}
    nodes = {(tag.get("pkg"), tag.get("type")) for tag in xml(path).iter("node")}
    missing = [
        f"{package}/{kind}"
        for package, kind in nodes
        if package in ours and not (ROOT / "src" / package / "nodes" / kind).is_file()
    ]

    assert missing == []


@pytest.mark.parametrize("path", **of(NODES))
def test_a_node_file_is_an_executable_that_only_calls_main(path):
    text = path.read_text()
    statements = ast.parse(text).body

    assert text.startswith("#!/usr/bin/env python3\n# SPDX-License-Identifier: BSD-3-Clause\n")
    assert os.access(path, os.X_OK)
    assert ast.get_docstring(ast.parse(text))
    assert not any(isinstance(s, ast.FunctionDef | ast.ClassDef) for s in statements)
    assert len(statements) <= 4, "docstring, import, main(); perhaps a second import"
    # Worker processes import the file that started them.
    assert ast.unparse(statements[-1]).startswith("if __name__ == '__main__':")


@pytest.mark.parametrize("path", **of(NODES))
def test_a_node_file_is_installed(path):
    rules = (path.parents[1] / "CMakeLists.txt").read_text()
    rules = rules.replace("${PROJECT_NAME}", path.parents[1].name)
    programs = re.findall(r"catkin_install_python\(\s*PROGRAMS(.*?)DESTINATION", rules, re.DOTALL)

    assert f"nodes/{path.name}" in " ".join(programs).split()


@pytest.mark.parametrize("package", **of(PACKAGES))
def test_what_a_package_needs_at_run_time_is_installed_with_it(package):
    rules = (package / "CMakeLists.txt").read_text()
    folders = {
        "config",
        "fleets",
        "launch",
        "models",
        "scenarios",
        "urdf",
        "worlds",
        "rviz",
        "resource",
    }
    missing = [
        name
        for name in sorted(folders)
        if (package / name).is_dir() and not re.search(rf"\b{name}\b", rules)
    ]

    assert missing == []


@pytest.mark.parametrize("package", **of(PACKAGES))
def test_every_python_package_is_named_in_setup_py(package):
    text = (package / "setup.py").read_text()
    folders = [path.parent for path in (package / "src").rglob("__init__.py")]
    names = [".".join(folder.relative_to(package / "src").parts) for folder in folders]

    assert [name for name in names if f'"{name}"' not in text] == []


@pytest.mark.parametrize("path", **of(sorted(ROOT.glob("src/*/src/**/__init__.py"))))
def test_an_init_file_is_a_docstring_only(path):
    body = ast.parse(path.read_text()).body

    assert len(body) == 1
    assert ast.get_docstring(ast.Module(body, []))
