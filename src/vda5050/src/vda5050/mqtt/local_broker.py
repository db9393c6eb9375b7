# SPDX-License-Identifier: BSD-3-Clause
"""Starts a mosquitto of one's own, for demos and tests."""

from __future__ import annotations

import contextlib
import os
import shutil
import socket
import subprocess
import sys
import time
from typing import TYPE_CHECKING

from vda5050.errors import BrokerError

if TYPE_CHECKING:
    from collections.abc import Iterator

_HOST = "127.0.0.1"
_PLACES = "/usr/sbin:/usr/local/sbin:/usr/bin"
"""Debian puts mosquitto where only root looks."""
_WITHIN = 10.0  # time to start [s]
_LOOK_EVERY = 0.02  # [s]


def mosquitto() -> str | None:
    """Return the path of the broker's program; None if it is not installed."""
    return shutil.which("mosquitto") or shutil.which("mosquitto", path=_PLACES)


def free_port() -> int:
    """Return a port of this machine that nobody uses at the moment."""
    with contextlib.closing(socket.socket()) as probe:
        probe.bind((_HOST, 0))
        return int(probe.getsockname()[1])


@contextlib.contextmanager
def local_broker(port: int) -> Iterator[int]:
    """Run a broker that only this machine reaches; yield its process id.

    Raises:
        BrokerError: mosquitto is missing or does not start.
    """
    program = mosquitto()
    if program is None:
        raise BrokerError("mosquitto is missing; ./hive setup installs it")
    # Without a settings file, mosquitto hears this machine only, and lets everybody in.
    process = subprocess.Popen(  # noqa: S603  (the program that was found)
        [program, "-p", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        _wait(process, port)
        yield process.pid
    finally:
        process.terminate()
        process.wait()


def _wait(process: subprocess.Popen[bytes], port: int) -> None:
    end = time.monotonic() + _WITHIN
    while process.poll() is None and time.monotonic() < end:
        with contextlib.suppress(OSError), socket.create_connection((_HOST, port), timeout=1.0):
            return
        time.sleep(_LOOK_EVERY)
    raise BrokerError(f"mosquitto did not start on port {port}; is the port taken?")


def main() -> None:
    """Become a broker that only this machine reaches; the first argument is its port."""
    program = mosquitto()
    if program is None:
        sys.exit("broker: mosquitto is missing; ./hive setup installs it")
    os.execv(program, [program, "-p", sys.argv[1]])  # noqa: S606  (the program that was found)
