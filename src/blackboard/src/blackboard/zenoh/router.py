# SPDX-License-Identifier: BSD-3-Clause
"""A router passes on what the members and programs of a hive say; its own session says nothing."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

import zenoh
from zenoh.handlers import Callback

from blackboard.zenoh.opening import open_session
from blackboard.zenoh.session import Mode, session_config

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from blackboard.zenoh.settings import ZenohSettings


@contextmanager
def running_router(settings: ZenohSettings, tell: Callable[[str], None]) -> Iterator[None]:
    """Run a router in threads of its own.

    Args:
        settings: Where it is reached, the routers that it connects to, and its certificate.
        tell: Called with a line when somebody is connected, and when its connection is gone.

    Raises:
        SettingsError: An endpoint or the certificate is not allowed, or Zenoh cannot start.
    """

    def note(event: zenoh.LinkEvent) -> None:
        is_new = event.kind == zenoh.SampleKind.PUT
        tell(f"{_who(event.link)} is {'connected' if is_new else 'gone'}")

    with open_session(session_config(settings.endpoints, settings.folder, Mode.ROUTER)) as session:
        # Zenoh's thread must not wait for whoever reads the lines.
        session.info.declare_link_events_listener(Callback(note, indirect=True), history=True)
        yield


def _who(link: zenoh.Link) -> str:
    """Return who is at the other end: whose certificate it has, or without any its address."""
    if link.auth_identifier:
        return str(link.auth_identifier).rpartition(".")[0]
    return str(link.dst).partition("/")[2]
