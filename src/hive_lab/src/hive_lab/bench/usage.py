# SPDX-License-Identifier: BSD-3-Clause
"""Processor time and memory of processes, read from /proc (see proc(5))."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

_UTIME, _STIME = 11, 12
"""Fields of /proc/PID/stat after the name, which is in brackets and may hold spaces."""


@dataclass(frozen=True)
class Usage:
    """What one process has used so far.

    Attributes:
        name: Its ROS name, or its program's name if it has none.
        cpu: Processor time, user and system [s].
        memory: Proportional set size [byte].
    """

    name: str
    cpu: float
    memory: int


def usage_of(pids: Iterable[int], proc: Path = Path("/proc")) -> dict[int, Usage]:
    """Return what processes have used so far, by id, without those that have ended."""
    found = {}
    for pid in pids:
        try:
            found[pid] = Usage(
                name=_name(proc / str(pid)),
                cpu=_cpu(proc / str(pid)),
                memory=_pss(proc / str(pid)),
            )
        except (OSError, IndexError):
            continue
    return found


def shares(
    before: Mapping[int, Usage], after: Mapping[int, Usage], seconds: float
) -> dict[str, tuple[float, int]]:
    """Return processor share [s per s] and memory [byte] by name, the largest share first.

    Processes that began between `before` and `after` count from their beginning; processes of one
    name are added up.
    """
    sums: dict[str, tuple[float, int]] = {}
    for pid, now in after.items():
        begin = before[pid].cpu if pid in before else 0.0
        cpu, memory = sums.get(now.name, (0.0, 0))
        sums[now.name] = (cpu + (now.cpu - begin) / seconds, memory + now.memory)
    return dict(sorted(sums.items(), key=lambda item: -item[1][0]))


def _cpu(folder: Path) -> float:
    fields = (folder / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[_UTIME]) + int(fields[_STIME])) / os.sysconf("SC_CLK_TCK")


def _pss(folder: Path) -> int:
    text = (folder / "smaps_rollup").read_text(encoding="utf-8")
    match = re.search(r"^Pss:\s+(\d+) kB", text, re.MULTILINE)
    return int(match[1]) * 1024 if match else 0


def _name(folder: Path) -> str:
    """Return `robot1/move_base` for a node, else the program's name."""
    words = (folder / "cmdline").read_text(encoding="utf-8").split("\0")
    node = next((word[len("__name:=") :] for word in words if word.startswith("__name:=")), "")
    is_python = Path(words[0]).name.startswith("python") and len(words) > 1
    program = Path(words[1] if is_python else words[0]).name
    if not node or program == "roslaunch":
        return program
    environ = (folder / "environ").read_text(encoding="utf-8", errors="replace").split("\0")
    space = next(
        (e[len("ROS_NAMESPACE=") :] for e in environ if e.startswith("ROS_NAMESPACE=")), ""
    )
    return f"{space.strip('/')}/{node}".lstrip("/")
