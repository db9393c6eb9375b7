# SPDX-License-Identifier: BSD-3-Clause
"""The files from which an experiment can be repeated: itself, and a copy of all of the user's own.

Files that come with the packages are named as they are; results say which version made them.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from hive_common.resources import beside, is_path

if TYPE_CHECKING:
    from hive_lab.compare.experiment import Experiment

EXPERIMENT, FLEET = "experiment.yaml", "fleet.yaml"

_FOLDERS = {"scenario": "scenarios", "world": "worlds", "map": "maps", "model": "models"}


def sources_of(experiment: Experiment) -> dict[str, bytes]:
    """Return the files from which an experiment can be repeated, by their paths in a folder."""
    copies = _Copies()
    content = _read(experiment.path)
    for key in ("scenario", "world", "map"):
        if content.get(key) is not None:
            content[key] = copies.of(key, getattr(experiment, key))
    path = experiment.fleet_of(experiment.variants[0]).path
    fleet = _read(path)
    for robot in fleet["robots"]:
        if robot.get("model"):
            robot["model"] = copies.of("model", beside(path, robot["model"]), "./")
    content["fleet"] = f"./{FLEET}"
    return {EXPERIMENT: _written(content), FLEET: _written(fleet), **copies.files}


class _Copies:
    """Copies of files that a person has given by their paths.

    Attributes:
        files: What they hold, by their paths in the folder.
    """

    def __init__(self) -> None:
        self.files: dict[str, bytes] = {}
        self._known: dict[str, str] = {}  # the copy of each original

    def of(self, kind: str, name: str, to: str = "./") -> str:
        """Return what to write for a file: the name of one that comes along, or of its copy.

        Args:
            kind: A key of `_FOLDERS`.
            name: Its name or absolute path.
            to: The folder of the copies, as seen from the file that names it.
        """
        if not is_path(name):
            return name
        if name not in self._known:
            self._known[name] = self._copy(kind, Path(name))
        return f"{to}{self._known[name]}"

    def _copy(self, kind: str, file: Path) -> str:
        path = self._free(f"{_FOLDERS[kind]}/{file.name}")
        if kind == "map":
            self._copy_map(file, path)
        elif kind == "scenario":
            self._copy_scenario(file, path)
        else:
            self.files[path] = file.read_bytes()
        return path

    def _copy_map(self, file: Path, path: str) -> None:
        content = _read(file)
        image = Path(beside(file, f"./{content['image']}"))
        copy = self._free(f"{Path(path).parent}/{image.name}")
        self.files[copy] = image.read_bytes()
        content["image"] = Path(copy).name
        self.files[path] = _written(content)

    def _copy_scenario(self, file: Path, path: str) -> None:
        content = _read(file)
        self.files[path] = b""  # its name is taken
        for key in ("world", "map"):
            if content.get(key):
                content[key] = self.of(key, beside(file, content[key]), "../")
        content["fleet"] = f"../{FLEET}"
        self.files[path] = _written(content)

    def _free(self, path: str) -> str:
        """Return a path that no other copy has; a file keeps its name, a folder need not."""
        folder, name = path.split("/")
        number, free = 1, path
        while free in self.files:
            number += 1
            free = f"{folder}-{number}/{name}"
        return free


def _read(file: Path) -> Any:  # noqa: ANN401  (what a checked YAML file holds)
    return yaml.safe_load(file.read_text(encoding="utf-8"))


def _written(content: object) -> bytes:
    text: str = yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
    return text.encode()
