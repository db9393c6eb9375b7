# SPDX-License-Identifier: BSD-3-Clause
"""Opens the session of a process."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import zenoh

from blackboard.errors import NoRouterError, SettingsError
from blackboard.zenoh.session import Mode
from blackboard.zenoh.user_timeout import end_dead_connections

if TYPE_CHECKING:
    from collections.abc import Mapping


def open_session(config: Mapping[str, Any]) -> zenoh.Session:
    """Open a session as `session.session_config` says; dead connections do not last.

    Raises:
        NoRouterError: It is a client's, and none of its routers answers.
        SettingsError: Zenoh cannot, for example because a port is taken; the text says why.
    """
    # The other lines tell only that a session was closed while it was being spoken to.
    zenoh.init_log_from_env_or("error,zenoh::api::session=off")
    try:
        session = zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
    except zenoh.ZError as error:
        if config["mode"] == Mode.CLIENT.value:
            routers = ", ".join(config["connect"]["endpoints"])
            raise NoRouterError(
                f"no router answers at {routers}; start it with `hive router NAME`, and check the "
                "certificates of both"
            ) from None
        ends = ", ".join(config["listen"]["endpoints"]) or "nowhere"
        raise SettingsError(
            f"Zenoh cannot start (it is to listen at: {ends}): {error}; give each process of a "
            "machine a port of its own, and an address of this machine"
        ) from None
    end_dead_connections(session)
    return session
