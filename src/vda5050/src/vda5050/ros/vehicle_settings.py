# SPDX-License-Identifier: BSD-3-Clause
"""What the nodes of this package are told by parameters."""

from typing import Annotated

import attrs

from hive_common.pose import Pose
from hive_common.structuring import Name, between, one_of
from vda5050.protocol.topics import TopicPart
from vda5050.protocol.versions import Version
from vda5050.vehicle.rates import Rates


@attrs.frozen(kw_only=True)
class _Vehicle:
    """What every vehicle is called and speaks."""

    manufacturer: TopicPart
    serial: TopicPart
    version: Annotated[str, one_of(*(version.value for version in Version))] = "2.1"
    interface: TopicPart | None = None
    """The first part of its topics; None for what its version proposes."""
    rates: Rates = attrs.field(factory=Rates)


@attrs.frozen(kw_only=True)
class AgvEntry(_Vehicle):
    """One AGV of the parameter `~agvs` of `simulated_agv`."""

    name: Name
    """Of its robot in the simulator."""
    model: Name
    pose: Pose
    """Where it starts, frame map [m, m, rad]."""
    charge: Annotated[float, between(0, 1, "how full the battery is")] = 1.0


@attrs.frozen(kw_only=True)
class ConnectorEntry(_Vehicle):
    """The private parameters of `vda5050_connector`."""

    map_id: Name = "map"
    """What the master calls the robot's map."""


@attrs.frozen(kw_only=True)
class AgentEntry(_Vehicle):
    """One AGV of the parameter `~robots` of `vda5050_agent`."""

    name: Name
    """Of the robot in the hive."""
    model: Name | None = None
    """None: what its factsheet tells."""
    maker: Name = "standard"
    """Name in `makers/` or path of a file with what its maker calls things."""
    simulated: bool = False
    """Whether the simulator shows where it is in RViz."""
