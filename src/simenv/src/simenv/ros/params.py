# SPDX-License-Identifier: BSD-3-Clause
"""The nodes' private parameters, read once and checked."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import rospy

from robot_description.follower import Pose
from simenv.errors import ParameterError
from simenv.mapper_settings import WITHOUT_EFFECT, MapperSettings
from simenv.noise import Noise

LEAST_RTF, MOST_RTF = 0.01, 100.0
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
        rtf=number("rtf", least=LEAST_RTF, most=MOST_RTF, default=1.0),
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


def mapper_settings() -> MapperSettings:
    """Read the mapper's parameters, which have the names that gmapping has for them.

    Raises:
        ParameterError: One is unknown, or not what it must be.
    """
    names = {field.name for field in fields(MapperSettings)}
    chosen: dict[str, float] = {}
    for name in rospy.get_param(rospy.get_name(), {}):
        if name in WITHOUT_EFFECT:
            rospy.logwarn(f"{rospy.get_name()}/{name} has no effect here; see config/mapper.yaml")
        elif name not in names:
            raise ParameterError(
                f"parameter ~{name} is unknown; allowed: {', '.join(sorted(names))}"
            )
        else:
            chosen[name] = number(name, least=-1e6, most=1e6)
    return MapperSettings(**chosen)


def text(name: str, default: str | None = None) -> str:
    """Return a private parameter that is a text; without a default it must be there."""
    value = str(rospy.get_param(f"~{name}", "" if default is None else default))
    if not value:
        raise ParameterError(f"parameter ~{name} is missing; give it as _{name}:=...")
    return value


def number(name: str, *, least: float, most: float, default: float | None = None) -> float:
    """Return a private parameter that is a number; without a default it must be there."""
    value = rospy.get_param(f"~{name}", default)
    if value is None:
        raise ParameterError(f"parameter ~{name} is missing; give it as _{name}:=...")
    good = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if not (good and least <= value <= most):
        raise ParameterError(
            f"parameter ~{name}: {value}; allowed: a number from {least:g} to {most:g}"
        )
    return float(value)


def whole_number(name: str, *, least: int, most: int, default: int) -> int:
    """Return a private parameter that is a whole number."""
    value = number(name, least=least, most=most, default=default)
    if value != int(value):
        raise ParameterError(f"parameter ~{name}: {value}; allowed: a whole number")
    return int(value)
