# SPDX-License-Identifier: BSD-3-Clause
"""Simulates many runs on all processors, and keeps each result in a file as soon as it is there.

A measurement of hours can be stopped at any time; with the same file it goes on where it was.
"""

from __future__ import annotations

import json
import subprocess
from concurrent.futures import as_completed
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hive_common.errors import FileError
from hive_lab.bench.workers import workers

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    Data = dict[str, Any]  # what JSON can hold


class KeptRuns:
    """Results of runs by name.

    Args:
        file: Where they are kept, a line each; None to keep nothing.

    Raises:
        FileError: The file holds something else.
    """

    def __init__(self, file: Path | None) -> None:
        self._file = file
        self._known: dict[str, Data] = {}
        if file is None or not file.exists():
            return
        whole = file.read_text(encoding="utf-8").rpartition("\n")[0]  # the last may be cut off
        for number, line in enumerate(whole.splitlines(), start=1):
            try:
                kept = json.loads(line)
                self._known[kept["run"]] = kept["result"]
            except (ValueError, TypeError, KeyError):
                allowed = "runs that --resume has written, or a file that is not there yet"
                raise FileError(f"{file}:{number}: {line[:40]!r}; allowed: {allowed}") from None
        file.write_text(f"{whole}\n" if whole else "", encoding="utf-8")

    def all_of(
        self, jobs: Mapping[str, tuple[Callable[..., Data], tuple[Any, ...]]]
    ) -> list[Data]:
        """Return the results of runs in their order; do those that are not known yet.

        Args:
            jobs: By the name of a run, a function of a module and its arguments.
        """
        todo = {name: job for name, job in jobs.items() if name not in self._known}
        with workers() as pool:
            under_way = {pool.submit(work, *given): name for name, (work, given) in todo.items()}
            for number, done in enumerate(as_completed(under_way), start=1):
                name = under_way[done]
                self.keep(name, done.result())
                click.echo(f"{name}: done ({number} of {len(todo)})", err=True)
        return [self._known[name] for name in jobs]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all runs that are known, the oldest first."""
        return tuple(self._known)

    def __getitem__(self, name: str) -> Data:
        """Return the result of a run that is known."""
        return self._known[name]

    def keep(self, name: str, result: Data) -> None:
        """Keep the result of a run."""
        self._known[name] = result
        if self._file is not None:
            with self._file.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"run": name, "result": result}) + "\n")


def program_tree() -> str:
    """Return the commit of this program, with a mark if files were changed; "?" without git."""
    try:
        done = subprocess.run(
            ["git", "describe", "--always", "--dirty"],  # noqa: S607  (the user's own git)
            cwd=Path(__file__).parent,
            capture_output=True,
            text=True,
            check=True,
        )
    except (OSError, subprocess.CalledProcessError):
        return "?"
    return done.stdout.strip()
