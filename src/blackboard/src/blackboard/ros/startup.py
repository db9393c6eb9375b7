# SPDX-License-Identifier: BSD-3-Clause
"""Runs a node of this package, and has it wait for what it needs to begin."""

from __future__ import annotations

import ctypes
import sys
from typing import TYPE_CHECKING, Any

import rospy

from blackboard.ros.rospy_patches.reading import handshake_apart, read_together
from hive_common.errors import HiveError
from hive_common.ros.links import mend_links
from hive_common.ros.refusal import forget_refusal, refuse_to_start
from hive_common.ros.sending import send_promptly
from hive_common.ros.signals import init_node

if TYPE_CHECKING:
    from collections.abc import Callable

_ARENA_MAX = -8
"""glibc's number of the option (malloc.h)."""

_PATIENCE = 5.0
"""Wall time between two warnings that a message is missing [s]."""


def run_node(name: str, run: Callable[[], None]) -> None:
    """Make this process a node and run it until it is shut down.

    `run` builds the node and spins. An error that a person has to mend ends the process with its
    text and exit code 1.
    """
    _save_memory()
    init_node(name)
    handshake_apart()
    send_promptly()
    read_together()
    mend_links()
    forget_refusal()
    try:
        run()
    except HiveError as error:
        refuse_to_start(str(error))
        sys.exit(1)
    except rospy.ROSInterruptException:
        return


def _save_memory() -> None:
    """Give back what importing has left over, and have all threads share one heap.

    glibc would give each thread a heap of its own, of which most stays unused. Only one Python
    thread runs at a time, so they do not wait for each other. Both save 2 MB in each process.
    """
    libc = ctypes.CDLL(None)
    if hasattr(libc, "mallopt"):  # other C libraries lack it
        libc.mallopt(_ARENA_MAX, 1)
        libc.malloc_trim(0)


def wait_for(topic: str, kind: type, missing: str, remedy: str) -> Any:  # noqa: ANN401  (a message of the kind)
    """Wait for the next message on a topic; warn what is missing while there is none.

    Raises:
        rospy.ROSInterruptException: The node was shut down first.
    """
    while True:
        try:
            return rospy.wait_for_message(topic, kind, timeout=_PATIENCE)
        except rospy.ROSInterruptException:
            raise
        except rospy.ROSException:
            rospy.logwarn(f"no {missing} on {rospy.resolve_name(topic)} yet; {remedy}")
