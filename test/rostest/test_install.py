# SPDX-License-Identifier: BSD-3-Clause
"""What `catkin_make install` leaves is complete: it runs without the sources it came from."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

pytestmark = [
    pytest.mark.timeout(1800),  # a build and 30 starts of bash, on a machine that may be busy
    pytest.mark.xdist_group("install"),  # one install folder for all
]
ROOT = Path(__file__).resolve().parents[2]
PACKAGES = sorted(path.parent.name for path in ROOT.glob("src/*/package.xml"))
NODES = sorted(path for path in ROOT.glob("src/*/nodes/*") if path.is_file())


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Install a copy of the workspace, remove the copy, and return the install folder."""
    if not shutil.which("catkin_make"):
        pytest.skip("needs the environment of the workspace: ./hive test rostest")
    workspace = tmp_path_factory.mktemp("workspace")
    folder = tmp_path_factory.mktemp("install")
    shutil.copytree(ROOT / "src", workspace / "src", symlinks=False, ignore=ignored)
    environment = dict(os.environ)
    for name in ("CMAKE_PREFIX_PATH", "ROS_PACKAGE_PATH", "PYTHONPATH"):
        environment.pop(name, None)
    done = subprocess.run(
        [
            "catkin_make",
            "install",
            f"--directory={workspace}",
            f"-DPYTHON_EXECUTABLE={ROOT}/.venv/bin/python3",
            f"-DCMAKE_INSTALL_PREFIX={folder}",
        ],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    shutil.rmtree(workspace)
    return folder


def ignored(folder, names):
    """Leave out what catkin put into src/ itself and what Python cached."""
    top = {"CMakeLists.txt"} if Path(folder) == ROOT / "src" else set()
    return (top | {"__pycache__"}) & set(names)


def in_install_space(folder, command):
    """Run a bash command with the install space sourced and the virtual environment on PATH."""
    environment = {
        "HOME": os.environ.get("HOME", "/"),
        "PATH": f"{ROOT}/.venv/bin:/usr/bin:/bin",
        "PYTHONNOUSERSITE": "1",
        "NUMBA_DISABLE_JIT": "1",  # compiling anew takes minutes, and tells nothing here
        "ROS_IP": "127.0.0.1",
    }
    return subprocess.run(
        ["bash", "-c", f"source {folder}/setup.bash && {command}"],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )


@pytest.mark.parametrize("package", PACKAGES)
def test_every_package_is_found_in_the_install_space(installed, package):
    found = in_install_space(installed, f"rospack find {package}")

    assert found.stdout.strip() == f"{installed}/share/{package}"


@pytest.mark.parametrize("path", NODES, ids=lambda path: f"{path.parts[-3]}/{path.name}")
def test_every_node_loads_from_the_install_space(installed, path):
    program = installed / "lib" / path.parts[-3] / path.name
    imports = "\n".join(
        line for line in path.read_text().splitlines() if line.startswith(("import ", "from "))
    )
    loaded = in_install_space(installed, f"python3 -c '{imports}'")

    assert os.access(program, os.X_OK)
    assert program.read_text() == path.read_text()
    assert loaded.returncode == 0, loaded.stderr


@pytest.mark.parametrize(
    "path", sorted(ROOT.glob("src/*/launch/*.launch")), ids=lambda path: path.name
)
def test_a_launch_file_can_be_read_from_the_install_space(installed, path):
    package = path.parts[-3]
    needed = in_install_space(installed, f"roslaunch --ros-args {package} {path.name}")

    assert needed.returncode == 0, needed.stderr
