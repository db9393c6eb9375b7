# SPDX-License-Identifier: BSD-3-Clause
"""The process that searches for plans and computes distance fields.

Pickled jobs come in on stdin, what is found goes out.
Run as `python -m blackboard.auction.search.worker`. It ends when its standard input does, so it
never outlives the process that started it.
"""

from __future__ import annotations

import os
import pickle
import sys

from blackboard.auction.search.fields import fields
from blackboard.auction.search.ruin_recreate import search
from blackboard.auction.search.searcher import Job

_LESS_URGENT = 5  # than the leader itself, whose heartbeats must not wait


def main() -> None:
    """Do one job after the other."""
    os.nice(_LESS_URGENT)
    while True:
        try:
            job = pickle.load(sys.stdin.buffer)  # noqa: S301  (of the process that started this one)
        except EOFError:
            return
        try:
            for found in [search(job)] if isinstance(job, Job) else fields(job):
                _tell(pickle.dumps(found, pickle.HIGHEST_PROTOCOL))
        except BrokenPipeError:  # whoever asked was killed meanwhile
            return


def _tell(answer: bytes) -> None:
    """Write all of an answer: a process that was stopped and goes on has written a part of it."""
    rest = memoryview(answer)
    while rest:
        rest = rest[os.write(sys.stdout.fileno(), rest) :]


if __name__ == "__main__":
    main()
