# SPDX-License-Identifier: BSD-3-Clause
"""Where journals are by default; for programs that read them and are no members."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import urlsplit

import rosgraph
import rosgraph.network
import rospkg


def default_folder() -> Path:
    """Return the folder of the journals if no parameter names one; each ROS master has its own.

    A machine has several names for itself, and whoever asks may use another one than the nodes.
    """
    address = urlsplit(rosgraph.get_master_uri())
    is_here = rosgraph.network.is_local_address(address.hostname)
    host = "localhost" if is_here else address.hostname
    return Path(rospkg.get_ros_home()) / "robo-hive" / f"{host}-{address.port}"
