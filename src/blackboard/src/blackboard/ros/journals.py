# SPDX-License-Identifier: BSD-3-Clause
"""Where journals are by default; for programs that read them and are no members."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import urlsplit

import rosgraph
import rosgraph.network
import rospkg

from blackboard.errors import SettingsError


def named_folder(caller: str) -> str:
    """Return the folder that the parameter `journal` names for a caller; empty where none does.

    As ROS does, it looks below the caller's name first, then in each namespace above it.

    Args:
        caller: The full name of a member or another node.

    Raises:
        OSError: No ROS master answers, so nothing is known.
        SettingsError: The parameter is not a text.
    """
    master = rosgraph.Master(caller)
    try:
        folder = master.getParam(master.searchParam("journal"))
    except rosgraph.MasterError:  # it has said that there is none
        return ""
    except rosgraph.MasterFailure as error:
        raise OSError(str(error)) from None
    if not isinstance(folder, str):
        raise SettingsError(f"journal is {folder!r}; allowed: the path of a folder")
    return folder


def default_folder() -> Path:
    """Return the folder of the journals if no parameter names one; each ROS master has its own.

    A machine has several names for itself, and whoever asks may use another one than the nodes.
    """
    address = urlsplit(rosgraph.get_master_uri())
    is_here = rosgraph.network.is_local_address(address.hostname)
    host = "localhost" if is_here else address.hostname
    return Path(rospkg.get_ros_home()) / "robo-hive" / f"{host}-{address.port}"
