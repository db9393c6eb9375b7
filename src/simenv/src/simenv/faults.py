# SPDX-License-Identifier: BSD-3-Clause
"""Faults that can be injected into a simulation, by name."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from shapely.geometry import box

from hive_common.pose import FARTHEST
from simenv.errors import FaultError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from simenv.simulation import Simulation


@dataclass(frozen=True)
class Fault:
    """One fault, or its end."""

    kind: str  # A name of `KINDS`
    target: str  # the robot; for `block`, a name for the obstacle
    value: float = 1.0  # its strength; 0 ends it
    area: tuple[float, ...] = ()  # for `block`: x_min, y_min, x_max, y_max, frame map [m]


def inject(simulation: Simulation, fault: Fault) -> str:
    """Inject a fault, or end it; return what was done, in words.

    Raises:
        SimenvError: The fault or robot is unknown, or the value is not allowed.
    """
    if fault.kind not in KINDS:
        raise FaultError(f"fault '{fault.kind}': not known; allowed: {', '.join(KINDS)}")
    if not math.isfinite(fault.value):
        raise FaultError(f"{fault.kind}: {fault.value} is not a finite number; 1 is on, 0 is off")
    return KINDS[fault.kind](simulation, fault)


def _freeze(simulation: Simulation, fault: Fault) -> str:
    frozen = _is_on(fault)
    simulation.freeze(fault.target, is_frozen=frozen)
    return f"{fault.target} {'stands still whatever it is told' if frozen else 'can move again'}"


def _slip(simulation: Simulation, fault: Fault) -> str:
    simulation.set_slip(fault.target, fault.value)
    return f"{fault.target}'s wheels turn in vain for {fault.value:.0%} of the way"


def _blind(simulation: Simulation, fault: Fault) -> str:
    covered = _is_on(fault)
    simulation.scanner(fault.target).is_covered = covered
    return f"{fault.target}'s laser {'is covered' if covered else 'sees again'}"


def _pick(simulation: Simulation, fault: Fault) -> str:
    if fault.value < 0 or fault.value != int(fault.value):
        raise FaultError(f"pick: {fault.value:g} grips; allowed: a whole number from 0 on")
    arm = simulation.arm(fault.target)
    if not arm.can_pick:
        raise FaultError(f"pick: {fault.target} has no arm; name a robot that has one")
    arm.fail_next = int(fault.value)
    return f"the next {fault.value:g} grips of {fault.target} fail"


def _block(simulation: Simulation, fault: Fault) -> str:
    if not _is_on(fault):
        simulation.obstacles.take(fault.target)
        return f"'{fault.target}' is out of the way"
    if len(fault.area) != len("xyxy") or not _is_box(fault.area):
        raise FaultError(
            f"block: area {list(fault.area)}; allowed: x_min, y_min, x_max, y_max in the map "
            "frame [m], each max above its min"
        )
    simulation.block(fault.target, box(*fault.area))
    return f"'{fault.target}' stands in the way"


def _is_box(area: tuple[float, ...]) -> bool:
    return max(map(abs, area)) <= FARTHEST and area[0] < area[2] and area[1] < area[3]


def _is_on(fault: Fault) -> bool:
    if fault.value not in {0.0, 1.0}:
        raise FaultError(f"{fault.kind}: {fault.value:g}; allowed: 1 for on, 0 for off")
    return fault.value == 1.0


KINDS: Mapping[str, Callable[[Simulation, Fault], str]] = {
    "freeze": _freeze,
    "slip": _slip,
    "blind": _blind,
    "pick": _pick,
    "block": _block,
}
"""The faults by name."""
