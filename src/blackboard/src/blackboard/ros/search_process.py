# SPDX-License-Identifier: BSD-3-Clause
"""The process beside the leader that searches for plans."""

from __future__ import annotations

import pickle
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from blackboard.auction.search.searcher import Found, Job
    from blackboard.domain.path_lengths import Field, FieldJob
    from blackboard.process.talker import MemberTalker


_PIPE = 2**20
"""Size of the pipes [bytes]: fields are tens of megabytes, and for each time that a pipe is full
the thread that reads it waits for the interpreter's lock."""


class SearchProcess:
    """A `Searcher` that runs `blackboard.auction.search.worker` while this member leads.

    Attributes:
        process: What runs; None while nothing does.
    """

    def __init__(self, talker: MemberTalker) -> None:
        self._talker = talker
        self._number = 0
        self.process: subprocess.Popen[bytes] | None = None
        self._threads = ThreadPoolExecutor(1, "search")
        self._is_closed = False

    def start(self) -> None:
        """See `Searcher.start`."""
        if self._is_closed:
            return
        if self.process is not None:
            if self.process.poll() is None:
                return
            self._bury(self.process)
        try:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "blackboard.auction.search.worker"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                pipesize=_PIPE,
                start_new_session=True,  # Ctrl-C is for the leader, which ends it
            )
        except OSError as error:
            self.process = None
            self._talker.warn(
                f"the search for plans cannot start: {error}; tasks are auctioned one by one"
            )

    def search(self, job: Job, done: Callable[[Found | None], None]) -> None:
        """See `Searcher.search`."""
        self._begin(job, 1, lambda found: done(found[0] if found else None))

    def fields(self, job: FieldJob, done: Callable[[Sequence[Field] | None], None]) -> None:
        """See `Searcher.fields`."""
        self._begin(job, len(job.goals), done)

    def _begin(
        self, job: Job | FieldJob, answers: int, done: Callable[[list[Any] | None], None]
    ) -> None:
        self.start()  # again, if it has ended
        self._number += 1
        number, process = self._number, self.process
        if self._is_closed:
            return

        def work() -> None:
            found = _ask(process, job, answers) if number == self._number else None
            self._talker.call(lambda: done(found) if number == self._number else None)

        self._threads.submit(work)

    def drop(self) -> None:
        """See `Searcher.drop`."""
        self._number += 1

    def stop(self) -> None:
        """See `Searcher.stop`."""
        self.drop()
        process, self.process = self.process, None
        if process is not None:
            self._bury(process)

    def close(self) -> None:
        """End for good, with the program."""
        self._is_closed = True  # the talker's thread may still ask for searches
        self.stop()
        self._threads.shutdown()

    def _bury(self, process: subprocess.Popen[bytes]) -> None:
        """End a process, and what waits for its answer."""
        process.kill()
        self._threads.submit(_close, process)


def _close(process: subprocess.Popen[bytes]) -> None:
    process.wait()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with suppress(OSError):  # what was not written yet
                pipe.close()


def _ask(
    process: subprocess.Popen[bytes] | None, job: Job | FieldJob, answers: int
) -> list[Any] | None:
    """Have a process do a job; return its answers.

    A process that does not give them is ended, for what it says next could not be told from them;
    the answer is None then.
    """
    if process is None or process.stdin is None or process.stdout is None:
        return None
    try:
        pickle.dump(job, process.stdin, pickle.HIGHEST_PROTOCOL)
        process.stdin.flush()
        return [pickle.load(process.stdout) for _ in range(answers)]  # noqa: S301  (our process)
    except Exception:  # noqa: BLE001  (odd bytes raise anything, an OSError or EOFError mostly)
        process.kill()
        process.wait()
        return None
