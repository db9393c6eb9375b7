# SPDX-License-Identifier: BSD-3-Clause
"""Where the files that come with this package lie, in a workspace and after installing."""

from __future__ import annotations

from pathlib import Path


def package_folder(name: str) -> Path:
    """Return a folder of this package.

    It lies beside the sources in a workspace and in `share/` after `catkin_make install`.

    Args:
        name: `worlds` or `maps`.
    """
    here = Path(__file__).resolve()
    places = (here.parents[2] / name, here.parents[4] / "share/simenv" / name)
    return next((place for place in places if place.is_dir()), places[0])


def named_file(folder: str, name_or_path: str) -> Path | None:
    """Return the YAML file that a person means by a name or a path.

    Args:
        folder: `worlds` or `maps`, where names are looked up.
        name_or_path: The name of a file of that folder (`lab`), or the path of a YAML file.

    Returns:
        The path, whether or not there is such a file; None for a name that is not known.
    """
    if name_or_path.endswith(".yaml") or "/" in name_or_path:
        return Path(name_or_path)
    path = package_folder(folder) / f"{name_or_path}.yaml"
    return path if name_or_path and path.is_file() else None


def file_names(folder: str) -> list[str]:
    """Return the names that `named_file` knows in a folder, sorted."""
    return sorted(path.stem for path in package_folder(folder).glob("*.yaml"))
