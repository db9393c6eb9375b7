# SPDX-License-Identifier: BSD-3-Clause
"""Finds the files that come with the packages, by name, in a source tree or where installed.

A user says `--fleet warehouse` for a file that comes along and `--fleet ./mine.yaml` for one of
their own. It does without rospkg, so that the cores can read their files without ROS.
"""

from __future__ import annotations

import os
from pathlib import Path

from hive_common.errors import FileError

MAX_SHOWN = 80  # characters shown of a name that is not known


def package_folder(package: str) -> Path:
    """Return the folder that holds the launch files, fleets, maps and so on of a package.

    It is the package's folder in the source tree if this module runs from there, else its share
    folder beside this installation or below a path in CMAKE_PREFIX_PATH.

    Raises:
        FileError: There is none; the environment was not sourced.
    """
    here = Path(__file__).resolve()
    prefixes = os.environ.get("CMAKE_PREFIX_PATH", "").split(os.pathsep)
    shares = [
        here.parents[4] / "share",
        *(Path(prefix) / "share" for prefix in prefixes if prefix),
    ]
    for folder in [here.parents[3] / package, *(share / package for share in shares)]:
        if (folder / "package.xml").is_file():
            return folder
    raise FileError(f"package {package} is not found; source devel/setup.bash first")


def node_file(package: str, node: str) -> Path:
    """Return the file of one of our nodes, which Python runs; found like `package_folder`.

    So a package can start another one's node, as a launch file does, without knowing its modules.

    Raises:
        FileError: There is none; the environment was not sourced.
    """
    folder = package_folder(package)
    for file in (folder / "nodes" / node, folder.parents[1] / "lib" / package / node):
        if file.is_file():
            return file
    raise FileError(f"package {package} has no node {node}; source devel/setup.bash first")


def is_path(name: str) -> bool:
    """Return whether a user means a path (anything with a slash or a dot), not a name."""
    return "/" in name or "." in name


def beside(file: Path, name: str) -> str:
    """Return a name as it is, but a path relative to the folder of the `file` that holds it."""
    if not is_path(name):
        return name
    return str((file.resolve().parent / Path(name).expanduser()).resolve())


def find_file(package: str, folder: str, name: str) -> Path:
    """Return the YAML file that a user means by a name or a path.

    Args:
        package: The package whose files may be named, such as `fleet_manager`.
        folder: Its folder with those files, such as `fleets`.
        name: Name of one of them without `.yaml`, or a path, which is returned unchecked.

    Raises:
        FileError: There is no file of that name; the text lists the known names.
    """
    if is_path(name):
        return Path(name).expanduser()
    known = names_in(package, folder)
    if name not in known:
        kind = "robot model" if folder == "models" else folder.removesuffix("s")
        raise FileError(
            f"{kind} {name[:MAX_SHOWN]!r}: not known; allowed: {', '.join(known)}, "
            "or the path of a .yaml file"
        )
    return package_folder(package) / folder / f"{name}.yaml"


def names_in(package: str, folder: str) -> list[str]:
    """Return the names, sorted, of the YAML files in a folder of a package."""
    return sorted(path.stem for path in (package_folder(package) / folder).glob("*.yaml"))
