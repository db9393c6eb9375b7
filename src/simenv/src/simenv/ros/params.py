# SPDX-License-Identifier: BSD-3-Clause
"""The simulator's private parameters, read once and checked."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import rospy

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
