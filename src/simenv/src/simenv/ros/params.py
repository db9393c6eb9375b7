# SPDX-License-Identifier: BSD-3-Clause
"""The nodes' private parameters, read once and checked."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import rospy

from hive_common.pose import Pose
from hive_common.ros.params import number, text, whole_number
from simenv.sensors.noise import Noise

MIN_RTF, MAX_RTF = 0.01, 100.0
"""Between these a real-time factor is taken."""


@dataclass(frozen=True)
class SimulatorParams:
    """What `simulator.launch` sets.

    Attributes:
        world: Name or path of the world.
        rtf: Simulated time per time on the wall.
        seed: Of all noise.
        noise: How wrong the robots' senses are.
        pick_failures: Probability that a grip fails.
    """

    world: str
    rtf: float
    seed: int
    noise: Noise
    pick_failures: float


@dataclass(frozen=True)
class SpawnParams:
    """What `spawn.launch` sets.

    Attributes:
        name: The robot's name.
        model: Name or path of its model.
        pose: Where its base is to stand, frame map [m, m, rad].
        timeout: How long to wait for the simulator, on the wall clock [s].
    """

    name: str
    model: str
    pose: Pose
    timeout: float


def simulator_params() -> SimulatorParams:
    """Read the simulator's parameters; `~noise_laser` and the like stand above `~noise`.

    Raises:
        ParameterError: One is not what it must be.
    """
    share = number("noise", least=0.0, most=100.0, default=1.0)
    return SimulatorParams(
        world=text("world", default="lab"),
        rtf=number("rtf", least=MIN_RTF, most=MAX_RTF, default=1.0),
        seed=whole_number("seed", least=0, most=2**31, default=0),
        noise=replace(
            Noise().times(share),
            **{
                name: number(f"noise_{name}", least=0.0, most=10.0)
                for name in (field.name for field in fields(Noise))
                if rospy.has_param(f"~noise_{name}")
            },
        ),
        pick_failures=number("pick_failures", least=0.0, most=1.0, default=0.0),
    )


def spawn_params() -> SpawnParams:
    """Read what to spawn.

    Raises:
        ParameterError: Something is missing, or not what it must be.
    """
    x, y = (number(axis, least=-1000.0, most=1000.0) for axis in ("x", "y"))
    yaw = number("yaw", least=-1000.0, most=1000.0, default=0.0)
    return SpawnParams(
        name=text("name"),
        model=text("model"),
        pose=Pose(x, y, yaw),
        timeout=number("timeout", least=0.1, most=3600.0, default=60.0),
    )
